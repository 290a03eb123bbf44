/* Repeatable noise: standard normal draws as a pure function of (seed, sample index). */
#ifndef NOISE_H
#define NOISE_H

#include <stdint.h>

#include "hidden.h"

/* Four 64-bit words of Philox4x64-10 with key (seed, 0) and counter (block, index, 0, 0). */
void philox(uint64_t seed, uint64_t index, uint64_t block, uint64_t words[4]);

/* n independent draws for a sample. */
void standard_normal(uint64_t seed, uint64_t index, int n, double *draws);

#endif
