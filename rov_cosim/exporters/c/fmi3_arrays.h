/* The variables of FMI 3.0: the same elements, as arrays. */
#ifndef FMI3_ARRAYS_H
#define FMI3_ARRAYS_H

#include "slave.h"

/* One that begins at this place in `variables`, which is its value reference; without a name where none begins. */
typedef struct {
    const char *name;
    uint32_t size;
} Array;

extern const Array arrays[N_VARIABLES];

enum { TIME = N_VARIABLES }; /* value reference of the independent variable */

/* Refuse a value reference where an array of a type is expected. */
int refuse_reference(Slave *slave, uint32_t reference, const char *type);

#endif
