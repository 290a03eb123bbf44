#include <float.h>
#include <math.h>
#include <string.h>

#include "instance.h"

/* --- checks --- */

/* Say, after some words, what a value is and what it should be. */
static void say_range(Instance *instance, const char *before, int reference, double value) {
    const Variable *v = &variables[reference];
    char a[NUMBER_SIZE], b[NUMBER_SIZE], c[NUMBER_SIZE];
    int below = v->minimum != -DBL_MAX, above = v->maximum != DBL_MAX;
    say(instance->message, "%s%s is %s; expected a finite number", before, v->name, number(value, 6, a));
    if (below)
        append(instance->message, " of at least %s", number(v->minimum, 6, b));
    if (above)
        append(instance->message, " %s at most %s", below ? "and" : "of", number(v->maximum, 6, c));
    append(instance->message, ".");
}

const char *phase_name(int64_t phase) {
    return phase == INSTANTIATED ? "instantiated" : phase == INITIALIZING ? "initializing"
         : phase == RUNNING      ? "running"      : "terminated";
}

static int check_parameters(Instance *instance) {
    double margins[N_REQUIREMENTS + 1] = {0};
    const double *arguments[] = {&instance->now.values[FIRST_PARAMETER]};
    double *results[] = {margins};
    if (!instance->now.unchecked)
        return 1;
    if (N_REQUIREMENTS)
        model_margins(arguments, results, 0, 0, 0);
    say(instance->message, "");
    for (int i = 0; requirements[i]; i++)
        if (!(margins[i] > 0))
            append(instance->message, "%s%s", instance->message[0] ? " " : "", requirements[i]);
    if (instance->message[0])
        return 0;
    instance->now.unchecked = 0;
    return 1;
}

/* Check what follows from the values at a time. */
static int check_result(Instance *instance, const Result *result, const char *what, double time) {
    char text[NUMBER_SIZE];
    Message failed;
    int y = 0, x = 0;
    while (y < N_Y && legal(FIRST_OUTPUT + y, result->y[y]))
        y++;
    while (x < N_X && isfinite(result->x[x]))
        x++;
    if (y == N_Y && x == N_X)
        return 1;
    say(failed, "The %s %s s failed: ", what, number(time, 9, text));
    if (y < N_Y)
        say_range(instance, failed, FIRST_OUTPUT + y, result->y[y]);
    else
        say(instance->message, "%sthe state %s is %s; expected a finite number.", failed, states[x],
            number(result->x[x], 6, text));
    append(instance->message, " Check the inputs and parameters, or take a shorter step.");
    return 0;
}

/* Tell the warnings of outputs `y` that the previous ones, if any, did not ask for. */
static void notify(Instance *instance, const double *y, const double *previous) {
    char time[NUMBER_SIZE];
    for (const Notice *notice = notices; notice->message; notice++) {
        if (y[notice->output] != notice->value || (previous && previous[notice->output] == notice->value))
            continue;
        say(instance->message, "At %s s: %s", number(instance->now.time, 9, time), notice->message);
        instance->warn(instance->receiver, instance->message);
    }
}

/* --- values --- */

void reset(Instance *instance) {
    memset(&instance->now, 0, sizeof instance->now);
    for (int i = 0; i < N_VARIABLES; i++)
        instance->now.values[i] = variables[i].start;
    instance->now.phase = INSTANTIATED;
    instance->now.stop_time = INFINITY;
    instance->now.stale = instance->now.unchecked = 1;
}

void why_not_variable(Instance *instance, uint32_t reference, Type type) {
    static const char *const names[] = {"Real", "Integer", "Boolean", "String"};
    if (reference >= N_VARIABLES)
        say(instance->message, "There is no variable with value reference %lu; expected 0 to %d.", (unsigned long)reference,
            N_VARIABLES - 1);
    else
        say(instance->message, "%s (value reference %lu) is of type %s, not %s.", variables[reference].name,
            (unsigned long)reference, names[variables[reference].type], names[type]);
}

void why_not_settable(Instance *instance, uint32_t reference, double value) {
    if (!legal((int)reference, value))
        say_range(instance, "", (int)reference, value);
    else if (is_output(reference))
        say(instance->message, "%s is an output: only inputs and parameters can be set.", variables[reference].name);
    else
        say(instance->message, "%s is a fixed parameter: set it before the initialization ends.",
            variables[reference].name);
}

int is_rate_settable(Instance *instance, uint32_t reference, double rate) {
    char text[NUMBER_SIZE];
    if (!interpolates_inputs)
        say(instance->message, "The inputs are read at samples, so they have no derivatives (canInterpolateInputs is false).");
    else if (reference >= N_U)
        say(instance->message, "%s is not an input: only inputs have derivatives.", variables[reference].name);
    else if (!isfinite(rate))
        say(instance->message, "The derivative of %s is %s; expected a finite number.", variables[reference].name,
            number(rate, 6, text));
    else
        return 1;
    return 0;
}

/* --- life --- */

double spacing(double time) {
    return nextafter(fabs(time), INFINITY) - fabs(time);
}

static Conditions conditions(const State *state) {
    Conditions at = {state->values, state->u_rate, &state->values[FIRST_PARAMETER], state->start_time, state->time};
    return at;
}

static void present(const Instance *instance, Result *state) {
    memcpy(state->x, instance->now.x, sizeof state->x);
    memcpy(state->y, &instance->now.values[FIRST_OUTPUT], sizeof state->y);
    state->samples = instance->now.samples;
}

static void accept(Instance *instance, const Result *state) {
    memcpy(instance->now.x, state->x, sizeof state->x);
    memcpy(&instance->now.values[FIRST_OUTPUT], state->y, sizeof state->y);
    instance->now.samples = state->samples;
}

static void initial_state(Instance *instance, double *x) {
    const double *arguments[] = {&instance->now.values[FIRST_PARAMETER]};
    double *results[] = {x};
    model_initial_state(arguments, results, 0, 0, 0);
}

int preview(Instance *instance) {
    Conditions at = conditions(&instance->now);
    Result first = {.samples = 0};
    if (!check_parameters(instance))
        return 0;
    initial_state(instance, first.x);
    present_outputs(&first, &at, first.y);
    if (!check_result(instance, &first, "initialization at", instance->now.time))
        return 0;
    accept(instance, &first);
    instance->now.stale = 0;
    return 1;
}

int set_times(Instance *instance, double start_time, double stop_time) {
    char start[NUMBER_SIZE], stop[NUMBER_SIZE];
    if (!isfinite(start_time) || !(stop_time >= start_time)) {
        say(instance->message, "The run is from %s s to %s s; expected finite times, the stop not before the start.",
            number(start_time, 9, start), number(stop_time, 9, stop));
        return 0;
    }
    instance->now.time = instance->now.start_time = start_time;
    instance->now.stop_time = stop_time;
    return 1;
}

int exit_initialization(Instance *instance) {
    if (!preview(instance))
        return 0;
    instance->now.phase = RUNNING;
    notify(instance, &instance->now.values[FIRST_OUTPUT], 0);
    return 1;
}

int do_step(Instance *instance, double time, double step) {
    State *now = &instance->now;
    double tolerance = TIME_TOLERANCE * fmax(1.0, now->time - now->start_time) + 4 * spacing(now->time);
    char a[NUMBER_SIZE], b[NUMBER_SIZE], c[NUMBER_SIZE];
    if (!(fabs(time - now->time) <= tolerance && isfinite(tolerance))) {
        say(instance->message, "Expected the communication point %s s but was %s s.", number(now->time, 9, a), number(time, 9, b));
        return 0;
    }
    if (!(step > 0 && isfinite(time + step))) {
        say(instance->message, "The step size is %s s; expected a positive number of seconds.", number(step, 6, a));
        return 0;
    }
    if (time + step > now->stop_time + tolerance) {
        say(instance->message, "The step ends at %s s; expected at most the stop time %s s.", number(time + step, 9, a),
            number(now->stop_time, 9, b));
        return 0;
    }
    if (!check_parameters(instance))
        return 0;
    if (step >= TIME_TOLERANCE) {
        Result result;
        Conditions at = conditions(now);
        at.time = time;
        present(instance, &result);
        double n = internal_steps(&result, &at, step);
        if (!(n <= MOST_INTERNAL_STEPS)) {
            say(instance->message, "The step of %s s takes %s internal steps; expected at most %s: take a shorter one.",
                number(step, 6, a), number(n, 3, b), number(MOST_INTERNAL_STEPS, 7, c));
            return 0;
        }
        take_step(&result, &at, step);
        if (!check_result(instance, &result, "step from", time))
            return 0;
        notify(instance, result.y, &now->values[FIRST_OUTPUT]);
        accept(instance, &result);
        memset(now->u_rate, 0, sizeof now->u_rate); /* they are given from the beginning of a step */
    }
    now->time = time + step;
    return 1;
}

int directional_derivative(Instance *instance, const double *du, double *dy) {
    Conditions at = conditions(&instance->now);
    Result state;
    if (!check_parameters(instance))
        return 0;
    present(instance, &state);
    if (instance->now.phase < RUNNING)
        initial_state(instance, state.x);
    present_derivative(&state, &at, du, dy);
    return 1;
}
