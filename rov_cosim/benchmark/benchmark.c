/* Prints what a communication step costs in ns: the traced function called bare, and fmi2DoStep with all its checks.

   Compiled with the sources of a component's FMU, with TRACED and TRACED_CALLS: the function and its calls in a step. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "slave.h"

enum { ROUNDS = 20, STEPS = 20000 };

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return 1e9 * (double)time.tv_sec + (double)time.tv_nsec;
}

static double bare(const Slave *slave, double internal_step) {
    static double y[N_Y];
    const double *values = slave->instance.now.values, draws[N_DRAWS + 1] = {0};
    double x[2][N_X], begin = now();
    memcpy(x[0], slave->instance.now.x, sizeof x[0]);
    for (int n = 0; n < STEPS * TRACED_CALLS; n++) {
        const double *last = interpolates_inputs ? &internal_step : draws;
        const double *arguments[] = {x[n % 2], values, &values[FIRST_PARAMETER], last};
        double *results[] = {x[(n + 1) % 2], y};
        TRACED(arguments, results, 0, 0, 0);
    }
    return (now() - begin) / STEPS;
}

static double through_fmi(fmi2Component c, double step) {
    double begin = now();
    fmi2Reset(c);
    fmi2SetupExperiment(c, 0, 0, 0, 0, 0);
    fmi2EnterInitializationMode(c);
    fmi2ExitInitializationMode(c);
    for (int n = 0; n < STEPS; n++)
        if (fmi2DoStep(c, n * step, step, fmi2True) != fmi2OK)
            return -1;
    return (now() - begin) / STEPS;
}

int main(void) {
    const double step = 0.03;
    fmi2CallbackFunctions callbacks = {0};
    fmi2Component c = fmi2Instantiate("benchmark", fmi2CoSimulation, guid, "", &callbacks, 0, 0);
    double best[2] = {1e300, 1e300};
    for (int round = 0; round < ROUNDS; round++) {
        double fmi = through_fmi(c, step), taken[2] = {bare(c, step / TRACED_CALLS), fmi};
        for (int i = 0; i < 2; i++)
            best[i] = taken[i] < best[i] ? taken[i] : best[i];
    }
    printf("%g %g\n", best[0], best[1]);
    return best[1] < 0;
}
