#ifndef SPACING_H
#define SPACING_H

#include "hidden.h"

/* The distance from a time to the next number beyond it. */
double spacing(double time);

/* By how much a time may be off where a step begins or ends that a host rounds to single precision: two spacings of such
   numbers, but at most a quarter of the step, which no step beside it comes near. It is 0 where they lie further apart than
   that: a host cannot keep its steps apart by them, and must have better ones. */
double leeway(double time, double step);

#endif
