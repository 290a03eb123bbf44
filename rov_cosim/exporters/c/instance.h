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

/* Those that return int return whether it went well. */

int legal(int reference, double value); /* finite and in range */
int is_output(uint32_t reference);
void reset(Instance *instance);
int is_variable(Instance *instance, uint32_t reference, Type type);
int is_settable(Instance *instance, uint32_t reference, double value);
void assign(Instance *instance, uint32_t reference, double value);
int is_rate_settable(Instance *instance, uint32_t reference, double rate);
int prepare_outputs(Instance *instance); /* before the first step they follow from inputs and parameters */
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
