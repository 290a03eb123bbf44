/* The steps of a component, to be timed: the traced functions called bare, as functions of state, inputs and parameters; with
   what follows from the parameters worked out before; with the noise that they are fed; and fmi2DoStep with all its checks.

   Compiled with the sources of a component's FMU; of a continuous one with INTERNAL_STEPS, those in a step. */
#include <string.h>

#include "fmi2Functions.h"
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

enum { CONSTANTS = 1, NOISE = 2 };

static void step_bare(size_t n, int with) {
    State *now = &((Slave *)component)->instance.now;
    const double *u = now->values, *p = &u[FIRST_PARAMETER], *k = now->constants;
    double *to = y;
    if (with & CONSTANTS) {
        double *constants = now->constants;
        model_constants(&p, &constants, 0, 0, 0);
    }
#ifdef INTERNAL_STEPS
    for (int i = 0; i < INTERNAL_STEPS; i++, last = !last) {
        double h = STEP / INTERNAL_STEPS;
        const double *arguments[] = {x[last], u, p, &h, k};
        double *results[] = {x[!last]};
        model_advance(arguments, results, 0, 0, 0);
    }
    const double *arguments[] = {x[last], u, p, k};
    model_outputs(arguments, &to, 0, 0, 0);
    (void)n;
#else
    double draws[N_DRAWS + 1] = {0};
    const double *arguments[] = {x[last], u, p, draws, k};
    double *results[] = {x[!last], to};
    if (with & NOISE)
        standard_normal(0, (uint64_t)n, N_DRAWS, draws);
    model_sample(arguments, results, 0, 0, 0);
    last = !last;
#endif
}

VISIBLE int traced(size_t n) { return step_bare(n, CONSTANTS), 0; }
VISIBLE int prepared(size_t n) { return step_bare(n, 0), 0; }
VISIBLE int drawn(size_t n) { return step_bare(n, NOISE), 0; }
VISIBLE int through_fmi(size_t n) { return fmi2DoStep(component, (double)n * STEP, STEP, fmi2True); }
