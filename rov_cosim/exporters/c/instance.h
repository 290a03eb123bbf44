/* One running copy of a component: its values, its clock, its checks, save and restore. No FMI in here.

   What is refused leaves the instance as it was, and `message` tells what was expected and what came. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stddef.h>
#include <stdint.h>

#include "interface.h"
#include "message.h"
#include "stepping.h"

enum { FIRST_OUTPUT = N_U, FIRST_PARAMETER = N_U + N_Y }; /* in the order of `variables` */

typedef enum { INSTANTIATED = 1, INITIALIZING = 2, RUNNING = 4, TERMINATED = 8 } Phase;

/* All that the rest of a run depends on. The outputs in `values` are those last computed. */
typedef struct {
    double values[N_VARIABLES], x[N_X], u_rate[N_U], time, start_time, stop_time; /* the last infinite if there is none */
    int64_t samples, phase;
    int64_t stale;     /* whether the outputs wait for a preview */
    int64_t unchecked; /* whether the parameters wait for their requirements */
} State;               /* all of one size, so that no byte of it is padding */

typedef void Warn(void *receiver, const char *message);

typedef struct {
    State now;
    Message message;
    Warn *warn;
    void *receiver; /* of `warn` */
} Instance;

/* Asked of each value that comes or goes in a step, hence inline. Each `why_not` says why it is not so. */

static inline int legal(int reference, double value) {
    return value >= variables[reference].minimum && value <= variables[reference].maximum; /* thus finite */
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

static inline void assign(Instance *instance, uint32_t reference, double value) {
    instance->now.values[reference] = value;
    instance->now.stale = 1;
    instance->now.unchecked |= reference >= FIRST_PARAMETER;
}

/* Before the first step the outputs follow from inputs and parameters. */
static inline int awaits_preview(const Instance *instance) {
    return instance->now.stale && instance->now.phase < RUNNING;
}

void why_not_variable(Instance *instance, uint32_t reference, Type type);
void why_not_settable(Instance *instance, uint32_t reference, double value);

/* Those that return int return whether it went well. */

void reset(Instance *instance);
int is_rate_settable(Instance *instance, uint32_t reference, double rate);
int preview(Instance *instance); /* the outputs of the beginning */
int set_times(Instance *instance, double start_time, double stop_time);
int exit_initialization(Instance *instance);
int do_step(Instance *instance, double time, double step);
int directional_derivative(Instance *instance, const double *du, double *dy);

enum { SAVED_SIZE = sizeof fingerprint + sizeof(uint64_t) + sizeof(State) };

uint64_t checksum(const State *state);
void save(const Instance *instance, char *bytes);
int is_own(Instance *instance, const char *bytes);   /* saved by this version of this component; the rest unchecked */
int is_saved(Instance *instance, const char *bytes); /* and undamaged, SAVED_SIZE bytes */
int restore(Instance *instance, const char *bytes);

const char *phase_name(int64_t phase);

#endif
