/* How a component gets from one communication point to the next. sampled.c or continuous.c has it, by its kind. */
#ifndef STEPPING_H
#define STEPPING_H

#include <stdint.h>

#include "interface.h"
#include "spacing.h"

typedef struct {
    double x[N_X], y[N_Y];
    int64_t samples; /* taken since the start */
} Result;

/* The values that a step starts from; its inputs are u + u_rate * (time since its begin). */
typedef struct {
    const double *u, *u_rate, *p, *constants;
    double start_time, time;
} Conditions;

extern const int interpolates_inputs;

/* About how many internal steps or samples a step of so many seconds takes. */
double internal_steps(const Result *before, const Conditions *at, double step);

/* Take the result of the last step on to that of this one. */
void take_step(Result *result, const Conditions *at, double step);

/* The outputs that follow from the state and the inputs as they are now. */
void present_outputs(const Result *state, const Conditions *at, double *y);

/* The directional derivative of these outputs for a change du of the inputs. */
void present_derivative(const Result *state, const Conditions *at, const double *du, double *dy);

#endif
