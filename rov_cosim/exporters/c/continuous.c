/* A component that is integrated over each communication step, in internal steps of the longest allowed length. */
#include <math.h>
#include <string.h>

#include "stepping.h"

const int interpolates_inputs = 1;

static void inputs_after(double time, const Conditions *at, double *u) {
    for (int i = 0; i < N_U; i++)
        u[i] = at->u[i] + at->u_rate[i] * time;
}

static void outputs(const double *x, const double *u, const Conditions *at, double *y) {
    const double *arguments[] = {x, u, at->p, at->constants};
    model_outputs(arguments, &y, 0, 0, 0);
}

double internal_steps(const Result *before, const Conditions *at, double step) {
    (void)before;
    return step / at->p[INTERNAL_STEP];
}

void take_step(Result *result, const Conditions *at, double step) {
    double longest = at->p[INTERNAL_STEP], u[N_U], x[N_X];
    int whole = (int)ceil(step / longest * (1 - STEP_TOLERANCE)) - 1;
    for (int i = 0; i <= whole; i++) {
        double h = i < whole ? longest : step - whole * longest;
        const double *arguments[] = {x, u, at->p, &h, at->constants};
        double *results[] = {result->x};
        memcpy(x, result->x, sizeof x);
        inputs_after(i * longest + h / 2, at, u); /* the midpoint rule: second order for inputs that change */
        model_advance(arguments, results, 0, 0, 0);
    }
    inputs_after(step, at, u);
    outputs(result->x, u, at, result->y);
}

void present_outputs(const Result *state, const Conditions *at, double *y) {
    outputs(state->x, at->u, at, y);
}

void present_derivative(const Result *state, const Conditions *at, const double *du, double *dy) {
    const double *arguments[] = {state->x, at->u, at->p, du};
    model_derivative(arguments, &dy, 0, 0, 0);
}
