#ifndef STATE_H
#define STATE_H

#include <stdint.h>

#include "interface.h"

/* All that the rest of a run depends on, beside the states of the elements. The outputs in `values` are those last read. */
typedef struct {
    double values[N_VARIABLES], start_time, stop_time; /* the last infinite if there is none */
    double time, skew;    /* the end of the last step, and by how much the host's clock is ahead of it: see `own_time` */
    int64_t steps, phase; /* inner steps since the start */
} State; /* all of one size, so that no byte of it is padding */

#endif
