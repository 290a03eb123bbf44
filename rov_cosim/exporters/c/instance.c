#include <math.h>
#include <string.h>

#include "instance.h"
#include "stepping.h"

/* --- checks --- */

static int check_parameters(Instance *instance) {
    double margins[N_REQUIREMENTS + 1] = {0}, *constants = instance->now.constants;
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
    model_constants(arguments, &constants, 0, 0, 0);
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

void assign_rate(Instance *instance, uint32_t reference, double rate) {
    instance->now.u_rate[reference] = rate;
}

/* --- life --- */

static Conditions conditions(const State *state) {
    Conditions at = {state->values, state->u_rate, &state->values[FIRST_PARAMETER], state->constants, state->start_time,
                     state->time};
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

int exit_initialization(Instance *instance) {
    if (!preview(instance))
        return 0;
    instance->now.phase = RUNNING;
    notify(instance, &instance->now.values[FIRST_OUTPUT], 0);
    return 1;
}

int do_step(Instance *instance, double time, double step) {
    State *now = &instance->now;
    double begin = own_time(instance, time);
    char a[NUMBER_SIZE], b[NUMBER_SIZE], c[NUMBER_SIZE];
    if (!is_step(instance, time, step))
        return 0;
    if (!check_parameters(instance))
        return 0;
    if (step >= TIME_TOLERANCE) {
        Result result;
        Conditions at = conditions(now);
        at.time = begin;
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
    now->skew = time - begin;
    now->time = begin + step;
    return 1;
}

int possible(const State *state) {
    static const double MOST_SAMPLES = 9007199254740992.0;
    int fine = plausible(state) && state->phase != FAILED;
    fine = fine && state->samples >= 0 && (double)state->samples < MOST_SAMPLES;
    fine = fine && (state->stale | state->unchecked | 1) == 1;
    for (int i = 0; i < N_X && fine; i++)
        fine = isfinite(state->x[i]);
    for (int i = 0; i < N_U && fine; i++)
        fine = isfinite(state->u_rate[i]);
    return fine;
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
