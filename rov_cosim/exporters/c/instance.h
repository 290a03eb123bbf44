/* One running copy of a component, or of a system of them: its values, its clock, its checks, save and restore. No FMI in here.

   What is refused leaves the instance as it was, and `message` tells what was expected and what came. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "environment.h"
#include "interface.h"
#include "message.h"
#include "spacing.h"
#include "state.h"

enum { FIRST_OUTPUT = N_U, FIRST_PARAMETER = N_U + N_Y }; /* in the order of `variables` */

typedef enum { INSTANTIATED = 1, INITIALIZING = 2, RUNNING = 4, TERMINATED = 8, FAILED = 16 } Phase; /* the last of a system */

typedef void Warn(void *receiver, const char *message);

typedef struct {
    State now;
    Message message;
    Warn *warn;
    void *receiver; /* of `warn` */
    void *parts;    /* of a system: see below */
} Instance;

/* Asked of each value that comes or goes in a step, hence inline. Each `why_not` says why it is not so. */

static inline int legal(int reference, double value) {
    /* Thus finite; by what raises no exception where it is not a number. */
    return isgreaterequal(value, variables[reference].minimum) && islessequal(value, variables[reference].maximum);
}

static inline int is_output(uint32_t reference) {
    return reference >= FIRST_OUTPUT && reference < FIRST_PARAMETER;
}

static inline int is_variable(uint32_t reference, Type type) {
    return reference < N_VARIABLES && variables[reference].type == type;
}

static inline int is_settable(const Instance *instance, uint32_t reference, double value) {
    return legal((int)reference, value) && !is_output(reference)
        && !(variables[reference].fixed && instance->now.phase >= RUNNING);
}

#include "own.h" /* `assign`, and `awaits_preview`: before the first step the outputs follow from inputs and parameters */

void why_not_variable(Instance *instance, uint32_t reference, Type type);
void why_not_settable(Instance *instance, uint32_t reference, double value);
void say_range(Instance *instance, const char *before, int reference, double value); /* what it is and what it should be */

/* Those that return int return whether it went well. */

void reset(Instance *instance);
int is_rate_settable(Instance *instance, uint32_t reference, double rate);
void assign_rate(Instance *instance, uint32_t reference, double rate);
APART int preview(Instance *instance); /* the outputs of the beginning */
APART int set_times(Instance *instance, double start_time, double stop_time);
APART int exit_initialization(Instance *instance);
int is_step(Instance *instance, double time, double step); /* whether its times fit; the rest unchecked */
double own_time(const Instance *instance, double time); /* the time, as a host has it, on the clock here */
APART int host_time(const Instance *instance, double *time); /* the end of the last step, as the host has it */
APART int do_step(Instance *instance, double time, double step);
APART int directional_derivative(Instance *instance, const double *du, double *dy);

enum { SAVED_SIZE = sizeof fingerprint + sizeof(uint64_t) + sizeof(State) }; /* without the parts */

uint64_t checksum(const State *state);
size_t saved_size(const Instance *instance);
int save(Instance *instance, char *bytes);
int is_own(Instance *instance, const char *bytes);   /* saved by this version of this component; the rest unchecked */
APART int is_saved(Instance *instance, const char *bytes); /* and undamaged, `saved_size` bytes */
APART int restore(Instance *instance, const char *bytes);
int plausible(const State *state); /* as far as components and systems are alike */
int possible(const State *state);  /* whether a run could have reached it */

/* What a system is made of; a component has none. `resources` is the location that the FMU was given, or NULL. */
int take_parts(Instance *instance, const char *resources);
void drop_parts(Instance *instance);
size_t size_of_parts(const Instance *instance);
int save_parts(Instance *instance, char *bytes);
int are_parts(Instance *instance, const char *bytes); /* saved by them and undamaged */
int restore_parts(Instance *instance, const char *bytes);

const char *phase_name(int64_t phase);

#endif
