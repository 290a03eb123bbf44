/* A system to play with, for a page in a browser: set values, run, read rows. The instance is the one behind its FMU. */
#include <stdint.h>
#include <stdlib.h>

#include "instance.h"
#include "lyapunov.h"

#ifdef __wasm__
#define API(name) __attribute__((export_name(#name)))
#else
#define API(name)
#endif

static Instance live;
static Message warning; /* the first of a run */

static void heed(void *receiver, const char *message) {
    (void)receiver;
    if (!warning[0])
        say(warning, "%s", message);
}

/* Memory that the caller writes and reads, for good; NULL if there is none. */
API(live_room) void *live_room(size_t size) {
    return malloc(size);
}

/* Why a call returned less than it was asked for (if it did), or what the run warned of first. */
API(live_message) const char *live_message(void) {
    return live.message;
}

API(live_warning) const char *live_warning(void) {
    return warning;
}

/* Begin anew, with the system's own values. Return whether that went well. */
API(live_begin) int live_begin(void) {
    live.warn = heed;
    warning[0] = live.message[0] = 0;
    if (!live.parts && !take_parts(&live, NULL))
        return 0;
    reset(&live);
    return 1;
}

/* Set a variable by its value reference, before the run. Return whether it is legal. */
API(live_set) int live_set(uint32_t reference, double value) {
    if (reference < N_VARIABLES && is_settable(&live, reference, value))
        return assign(&live, reference, value);
    if (reference < N_VARIABLES)
        why_not_settable(&live, reference, value);
    return 0;
}

/* --- the terms of the Lyapunov function, of a system that has what they take --- */

static double gains[N_GAINS + 1], constants[N_CONSTANTS + 1], terms[N_TERMS + 1];

static void gather(const uint32_t *references, size_t n, double *values) {
    for (size_t i = 0; i < n; i++)
        values[i] = live.now.values[references[i]];
}

static void prepare_terms(void) {
    const double *given[] = {gains};
    double *found[] = {constants};
    gather(of_gains, N_GAINS, gains);
    lyapunov_constants(given, found, NULL, NULL, 0);
}

static void take_terms(void) {
    double motion[N_MOTION + 1];
    const double *given[] = {motion, gains, constants};
    double *found[] = {terms};
    gather(of_motion, N_MOTION, motion);
    lyapunov(given, found, NULL, NULL, 0);
}

/* Take so many steps; write a column for each of n variables, by their value references, and of the terms, which come after
   them; with room for the values at the start and after every step. Return how many there are; if they are fewer, the message has why. */
API(live_run) size_t live_run(double step, size_t steps, const uint32_t *references, size_t n, double *columns) {
    if (!set_times(&live, 0, (double)steps * step))
        return 0;
    live.now.phase = INITIALIZING;
    if (!exit_initialization(&live))
        return 0;
    if (N_TERMS)
        prepare_terms();
    for (size_t k = 0; k <= steps; k++) {
        if (k && !do_step(&live, (double)(k - 1) * step, (double)k * step - (double)(k - 1) * step))
            return k;
        if (N_TERMS)
            take_terms();
        for (size_t i = 0; i < n; i++)
            columns[i * (steps + 1) + k] =
                references[i] < N_VARIABLES ? live.now.values[references[i]] : terms[references[i] - N_VARIABLES];
    }
    return steps + 1;
}
