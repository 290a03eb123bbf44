/* Philox4x64-10 (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC11) and the Box-Muller transform. */
#include <math.h>

#include "noise.h"

static const double PI = 3.14159265358979323846;

enum { ROUNDS = 10, WORDS = 4 };

#ifdef __SIZEOF_INT128__
__extension__ typedef unsigned __int128 Wide; /* which ISO C has not */
#endif

/* Both halves of a product of 64 bits each. */
static uint64_t multiply(uint64_t a, uint64_t b, uint64_t *high) {
#ifdef __SIZEOF_INT128__
    Wide product = (Wide)a * b;
    *high = (uint64_t)(product >> 64);
    return (uint64_t)product;
#else /* from products of 32 bits: not every compiler has a type of 128 bits */
    const uint64_t mask = 0xffffffffu;
    uint64_t low = (a & mask) * (b & mask);
    uint64_t middle = (a >> 32) * (b & mask) + (low >> 32);
    uint64_t other = (a & mask) * (b >> 32) + (middle & mask);
    *high = (a >> 32) * (b >> 32) + (middle >> 32) + (other >> 32);
    return (other << 32) | (low & mask);
#endif
}

void philox(uint64_t seed, uint64_t index, uint64_t block, uint64_t words[4]) {
    uint64_t key[2] = {seed, 0};
    words[0] = block;
    words[1] = index;
    words[2] = words[3] = 0;
    for (int round = 0; round < ROUNDS; round++) {
        uint64_t high0, high2;
        uint64_t low0 = multiply(UINT64_C(0xD2E7470EE14C6C93), words[0], &high0);
        uint64_t low2 = multiply(UINT64_C(0xCA5A826395121157), words[2], &high2);
        uint64_t first = high2 ^ words[1] ^ key[0], third = high0 ^ words[3] ^ key[1];
        words[0] = first;
        words[1] = low2;
        words[2] = third;
        words[3] = low0;
        key[0] += UINT64_C(0x9E3779B97F4A7C15);
        key[1] += UINT64_C(0xBB67AE8584CAA73B);
    }
}

static double uniform(uint64_t word) {
    return (double)((word >> 11) + 1) * 0x1p-53;
}

void standard_normal(uint64_t seed, uint64_t index, int n, double *draws) {
    uint64_t words[WORDS];
    for (int i = 0; i < n; i += 2) {
        int place = i % WORDS;
        if (place == 0)
            philox(seed, index, 1 + (uint64_t)(i / WORDS), words); /* NumPy counts blocks from one */
        double radius = sqrt(-2.0 * log(uniform(words[place])));
        double angle = 2.0 * PI * uniform(words[place + 1]);
        draws[i] = radius * cos(angle);
        if (i + 1 < n)
            draws[i + 1] = radius * sin(angle);
    }
}
