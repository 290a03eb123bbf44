/* The steps of a component, to be timed: the traced functions called bare, with or without the noise that they are fed, and
   fmi2DoStep with all its checks.

   Compiled with the sources of a component's FMU; of a continuous one with INTERNAL_STEPS, those in a step. */
#include <string.h>

#include "slave.h"
#ifndef INTERNAL_STEPS
#include "noise.h"
#endif

#define VISIBLE __attribute__((visibility("default")))

static const double STEP = 0.03;

static fmi2Component component;
static double x[2][N_X], y[N_Y];
static int last; /* the state of the two that is the latest */

VISIBLE void begin(void) {
    fmi2CallbackFunctions callbacks = {0};
    if (!component)
        component = fmi2Instantiate("benchmark", fmi2CoSimulation, guid, "", &callbacks, 0, 0);
    fmi2Reset(component);
    fmi2SetupExperiment(component, 0, 0, 0, 0, 0);
    fmi2EnterInitializationMode(component);
    fmi2ExitInitializationMode(component);
    memcpy(x[last], ((Slave *)component)->instance.now.x, sizeof x[last]);
}

static void step_bare(size_t n, int with_noise) {
    const double *u = ((Slave *)component)->instance.now.values, *p = &u[FIRST_PARAMETER];
    double *to = y;
#ifdef INTERNAL_STEPS
    for (int i = 0; i < INTERNAL_STEPS; i++, last = !last) {
        double h = STEP / INTERNAL_STEPS;
        const double *arguments[] = {x[last], u, p, &h};
        double *results[] = {x[!last]};
        model_advance(arguments, results, 0, 0, 0);
    }
    const double *arguments[] = {x[last], u, p};
    model_outputs(arguments, &to, 0, 0, 0);
    (void)n, (void)with_noise;
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

VISIBLE int traced(size_t n) { return step_bare(n, 0), 0; }
VISIBLE int traced_and_drawn(size_t n) { return step_bare(n, 1), 0; }
VISIBLE int through_fmi(size_t n) { return fmi2DoStep(component, (double)n * STEP, STEP, fmi2True); }
