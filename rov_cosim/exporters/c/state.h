#ifndef STATE_H
#define STATE_H

#include <stdint.h>

#include "interface.h"

/* All that the rest of a run depends on. The outputs in `values` are those last computed. */
typedef struct {
    double values[N_VARIABLES], x[N_X], u_rate[N_U], start_time, stop_time; /* the last infinite if there is none */
    double time, skew; /* the end of the last step, and by how much the host's clock is ahead of it: see `own_time` */
    double constants[N_CONSTANTS]; /* what follows from the parameters, once they are checked */
    int64_t samples, phase;
    int64_t stale;     /* whether the outputs wait for a preview */
    int64_t unchecked; /* whether the parameters wait for their requirements */
} State;               /* all of one size, so that no byte of it is padding */

#endif
