#ifndef SPACING_H
#define SPACING_H

#include "hidden.h"

/* The distance from a time to the next number beyond it. */
double spacing(double time);

#endif
