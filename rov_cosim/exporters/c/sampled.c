/* A component that reads its inputs at k * period and holds its outputs until the next sample. */
#include <math.h>

#include "noise.h"
#include "stepping.h"

const int interpolates_inputs = 0;

static void draw(const Result *state, const Conditions *at, double *draws) {
    if (N_DRAWS) /* else SEED is no seed, and may be beyond an integer */
        standard_normal((uint64_t)at->p[SEED], (uint64_t)state->samples, N_DRAWS, draws);
}

static void sample(const Result *state, const Conditions *at, double *x, double *y) {
    double draws[N_DRAWS + 1];
    const double *arguments[] = {state->x, at->u, at->p, draws};
    double *results[] = {x, y};
    draw(state, at, draws);
    model_sample(arguments, results, 0, 0, 0);
}

/* Time until which samples are due in a step: one that is due at its end belongs to the next step. */
static double due_until(const Conditions *at, double step) {
    double end = at->time + step, spacing = nextafter(fabs(end), INFINITY) - fabs(end);
    return end - at->start_time - (SAMPLE_TOLERANCE * at->p[INTERNAL_STEP] + 4 * spacing);
}

double internal_steps(const Result *before, const Conditions *at, double step) {
    return (at->time + step - at->start_time) / at->p[INTERNAL_STEP] - (double)before->samples;
}

void take_step(const Result *before, const Conditions *at, double step, Result *after) {
    double until = due_until(at, step), period = at->p[INTERNAL_STEP];
    *after = *before;
    while ((double)after->samples * period < until) {
        Result now = *after;
        sample(&now, at, after->x, after->y);
        after->samples++;
    }
}

void present_outputs(const Result *state, const Conditions *at, double *y) {
    sample(state, at, 0, y);
}

void present_derivative(const Result *state, const Conditions *at, const double *du, double *dy) {
    double draws[N_DRAWS + 1];
    const double *arguments[] = {state->x, at->u, at->p, draws, du};
    draw(state, at, draws);
    model_derivative(arguments, &dy, 0, 0, 0);
}
