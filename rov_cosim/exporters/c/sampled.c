/* A component that reads its inputs at k * period and holds its outputs until the next sample. */
#include <math.h>
#include <string.h>

#include "noise.h"
#include "stepping.h"

const int interpolates_inputs = 0;

static void draw(const Result *state, const Conditions *at, double *draws) {
    if (N_DRAWS) /* else SEED is no seed, and may be beyond an integer */
        standard_normal((uint64_t)at->p[SEED], (uint64_t)state->samples, N_DRAWS, draws);
}

static void sample(const Result *state, const Conditions *at, double *x, double *y) {
    double draws[N_DRAWS + 1];
    const double *arguments[] = {state->x, at->u, at->p, draws, at->constants};
    double *results[] = {x, y};
    draw(state, at, draws);
    model_sample(arguments, results, 0, 0, 0);
}

/* Time until which samples are due in a step: one that is due at its end belongs to the next step. */
static double due_until(const Conditions *at, double step) {
    double end = at->time + step;
    double elapsed = end - at->start_time, period = at->p[INTERNAL_STEP];
    return elapsed - fmax(SAMPLE_TOLERANCE * period + 4 * spacing(end), leeway(elapsed, fmin(step, period)));
}

double internal_steps(const Result *before, const Conditions *at, double step) {
    return (at->time + step - at->start_time) / at->p[INTERNAL_STEP] - (double)before->samples;
}

void take_step(Result *result, const Conditions *at, double step) {
    double until = due_until(at, step), period = at->p[INTERNAL_STEP];
    while ((double)result->samples * period < until) {
        double x[N_X];
        sample(result, at, x, result->y);
        memcpy(result->x, x, sizeof x);
        result->samples++;
    }
}

void present_outputs(const Result *state, const Conditions *at, double *y) {
    double unused[N_X];
    sample(state, at, unused, y);
}

void present_derivative(const Result *state, const Conditions *at, const double *du, double *dy) {
    double draws[N_DRAWS + 1];
    const double *arguments[] = {state->x, at->u, at->p, draws, du};
    draw(state, at, draws);
    model_derivative(arguments, &dy, 0, 0, 0);
}
