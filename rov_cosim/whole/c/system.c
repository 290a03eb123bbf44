/* A system as an instance: its values and its clock, over its elements. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "elements.h"
#include "instance.h"

const int interpolates_inputs = 0;

enum { COUPLING = N_VARIABLES - 1 };

static int coupling(const Instance *instance) {
    return (int)instance->now.values[COUPLING];
}

const char *name_of(uint32_t reference) {
    return variables[reference].name;
}

static void heed(void *receiver, const char *warning) {
    Instance *instance = receiver;
    say(instance->message, "%s", warning);
    instance->warn(instance->receiver, instance->message);
}

static int is_settled(uint32_t reference) { /* an output, which nobody sets, or what is no element's */
    return is_output(reference) || reference == COUPLING;
}

/* --- values --- */

void reset(Instance *instance) {
    memset(&instance->now, 0, sizeof instance->now);
    for (int i = 0; i < N_VARIABLES; i++)
        instance->now.values[i] = variables[i].start;
    instance->now.phase = INSTANTIATED;
    instance->now.stop_time = INFINITY;
    abandon(instance->parts);
}

int assign(Instance *instance, uint32_t reference, double value) {
    if (instance->now.phase < RUNNING)
        abandon(instance->parts);
    else if (!is_settled(reference) && !hand_in(instance->parts, reference, variables[reference].type, value))
        return 0;
    instance->now.values[reference] = value;
    return 1;
}

int is_rate_settable(Instance *instance, uint32_t reference, double rate) {
    (void)reference, (void)rate;
    say(instance->message, "The inputs of a system have no derivatives (canInterpolateInputs is false).");
    return 0;
}

void assign_rate(Instance *instance, uint32_t reference, double rate) {
    (void)instance, (void)reference, (void)rate;
}

/* --- life --- */

static int begin_anew(Instance *instance) {
    if (!renew(instance->parts))
        return 0;
    for (uint32_t i = 0; i < N_VARIABLES; i++)
        if (!is_settled(i) && !hand_in(instance->parts, i, variables[i].type, instance->now.values[i]))
            return 0;
    return enter(instance->parts, instance->now.start_time, coupling(instance));
}

int awaits_preview(const Instance *instance) {
    return instance->now.phase < RUNNING && !are_entered(instance->parts, instance->now.start_time);
}

int preview(Instance *instance) {
    double before[N_Y + 1], *outputs = &instance->now.values[FIRST_OUTPUT];
    memcpy(before, outputs, N_Y * sizeof *outputs);
    if (begin_anew(instance))
        return 1;
    memcpy(outputs, before, N_Y * sizeof *outputs);
    return 0;
}

int exit_initialization(Instance *instance) {
    if (awaits_preview(instance) && !preview(instance))
        return 0;
    instance->now.phase = leave(instance->parts) ? RUNNING : FAILED;
    return instance->now.phase == RUNNING;
}

int do_step(Instance *instance, double time, double step) {
    State *now = &instance->now;
    char a[NUMBER_SIZE], b[NUMBER_SIZE], c[NUMBER_SIZE];
    double begin = own_time(instance, time), end = begin + step;
    double whole = floor((end - now->start_time) / inner_step + 0.5), n = whole - (double)now->steps;
    double off = fabs(end - now->start_time - whole * inner_step);
    double rounding = SAMPLE_TOLERANCE * inner_step + 4 * spacing(end);
    if (!is_step(instance, time, step))
        return 0;
    if (step < TIME_TOLERANCE) {
        now->skew = time - begin;
        now->time = end;
        return 1;
    }
    if (!(n <= MOST_INTERNAL_STEPS)) {
        say(instance->message, "The step of %s s takes %s inner steps; expected at most %s: take a shorter one.",
            number(step, 6, a), number(n, 3, b), number(MOST_INTERNAL_STEPS, 7, c));
        return 0;
    }
    if (!(n >= 1 && off <= fmax(rounding, leeway(end - now->start_time, inner_step)))) {
        say(instance->message, "The step of %s s is no multiple of the inner step of %s s: its end, %s s, is none of its points.",
            number(step, 6, a), number(inner_step, 6, b), number(end, 9, c));
        return 0;
    }
    size_t done = advance(instance->parts, (size_t)now->steps, (size_t)n, now->start_time, coupling(instance));
    now->steps += (int64_t)done;
    now->skew = time - begin;
    if ((double)done < n) {
        now->time = now->start_time + (double)now->steps * inner_step;
        now->phase = FAILED; /* some elements took the step */
        return 0;
    }
    now->time = end;
    return 1;
}

int directional_derivative(Instance *instance, const double *du, double *dy) {
    (void)du, (void)dy;
    say(instance->message, "A system has no directional derivatives (providesDirectionalDerivative is false).");
    return 0;
}

/* --- elements --- */

int take_parts(Instance *instance, const char *resources) {
    instance->parts = new_elements(resources, instance->now.values, instance->message, heed, instance);
    if (instance->parts)
        instance->message[0] = 0; /* a warning is no reason */
    return instance->parts != NULL;
}

void drop_parts(Instance *instance) {
    free_elements(instance->parts);
}

size_t size_of_parts(const Instance *instance) {
    return states_size(instance->parts);
}

int possible(const State *state) {
    static const double MOST_STEPS = 9007199254740992.0;
    return plausible(state) && state->steps >= 0 && (double)state->steps < MOST_STEPS;
}

/* Before the run there is nothing to save: the elements follow from the values. */

int save_parts(Instance *instance, char *bytes) {
    if (instance->now.phase >= RUNNING)
        return save_states(instance->parts, bytes);
    memset(bytes, 0, states_size(instance->parts));
    return 1;
}

static int is_running(const char *bytes) {
    State state;
    memcpy(&state, bytes - sizeof state, sizeof state);
    return state.phase >= RUNNING;
}

int are_parts(Instance *instance, const char *bytes) {
    if (is_running(bytes))
        return are_states(instance->parts, bytes);
    for (size_t i = 0; i < states_size(instance->parts); i++) {
        if (bytes[i]) {
            say(instance->message, "The saved state is damaged: it is not what this component has saved.");
            return 0;
        }
    }
    return 1;
}

int restore_parts(Instance *instance, const char *bytes) {
    (void)bytes;
    if (instance->now.phase >= RUNNING)
        return restore_states(instance->parts); /* those that were checked last */
    abandon(instance->parts);
    return 1;
}
