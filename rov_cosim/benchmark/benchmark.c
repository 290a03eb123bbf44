/* Prints what a communication step costs in ns of the processor's time: the traced functions called bare, the same with the noise
   that they are fed, and fmi2DoStep with all its checks.

   Compiled with the sources of a component's FMU; of a continuous one with INTERNAL_STEPS, those in a step. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "slave.h"
#ifndef INTERNAL_STEPS
#include "noise.h"
#endif

enum { ROUNDS = 2, STEPS = 5000 }; /* short, for it is called many times, in turns with others */

static const double STEP = 0.03;

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return 1e9 * (double)time.tv_sec + (double)time.tv_nsec;
}

static double bare(const Slave *slave, int with_noise) {
    static double y[N_Y];
    const double *u = slave->instance.now.values, *p = &u[FIRST_PARAMETER];
    double x[2][N_X], *to = y, begin = now();
    int last = 0; /* the state that is the latest */
    memcpy(x[last], slave->instance.now.x, sizeof x[last]);
    for (int n = 0; n < STEPS; n++) {
#ifdef INTERNAL_STEPS
        for (int i = 0; i < INTERNAL_STEPS; i++, last = !last) {
            double h = STEP / INTERNAL_STEPS;
            const double *arguments[] = {x[last], u, p, &h};
            double *results[] = {x[!last]};
            model_advance(arguments, results, 0, 0, 0);
        }
        const double *arguments[] = {x[last], u, p};
        model_outputs(arguments, &to, 0, 0, 0);
        (void)with_noise;
#else
        double draws[N_DRAWS + 1] = {0};
        const double *arguments[] = {x[last], u, p, draws};
        double *results[] = {x[!last], to};
        if (with_noise)
            standard_normal(0, (uint64_t)n, N_DRAWS, draws);
        model_sample(arguments, results, 0, 0, 0);
        last = !last;
#endif
    }
    return (now() - begin) / STEPS;
}

static double through_fmi(fmi2Component c) {
    double begin = now();
    fmi2Reset(c);
    fmi2SetupExperiment(c, 0, 0, 0, 0, 0);
    fmi2EnterInitializationMode(c);
    fmi2ExitInitializationMode(c);
    for (int n = 0; n < STEPS; n++)
        if (fmi2DoStep(c, n * STEP, STEP, fmi2True) != fmi2OK)
            return -1;
    return (now() - begin) / STEPS;
}

int main(void) {
    fmi2CallbackFunctions callbacks = {0};
    fmi2Component c = fmi2Instantiate("benchmark", fmi2CoSimulation, guid, "", &callbacks, 0, 0);
    double best[3] = {1e300, 1e300, 1e300};
    for (int round = 0; round < ROUNDS; round++) {
        double fmi = through_fmi(c), taken[3] = {bare(c, 0), bare(c, 1), fmi};
        for (int i = 0; i < 3; i++)
            best[i] = taken[i] < best[i] ? taken[i] : best[i];
    }
    printf("%g %g %g\n", best[0], best[1], best[2]);
    return best[2] < 0;
}
