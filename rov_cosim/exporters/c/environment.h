#ifndef ENVIRONMENT_H
#define ENVIRONMENT_H

#include <stdint.h>

#include "hidden.h"

/* The floating-point environment of a thread. A host may have exceptions end the process, round another way, or make zeros of
   small numbers: what computes does so in the environment that C begins with, and leaves the host's as it was, its flags too.

   Not <fenv.h>, which is a part of libm, and takes twenty times as long. Elsewhere than on x86-64 and AArch64 the host's is used.
   What lies between `hold` and `give_back` is APART, else the compiler may compute some of it before or after. */

#if defined(__x86_64__) || defined(_M_X64)
#include <xmmintrin.h>

typedef unsigned Environment;

static inline Environment hold(void) {
    enum { ALL_MASKED = 0x1f80 };
    Environment host = _mm_getcsr();
    _mm_setcsr(ALL_MASKED);
    return host;
}

static inline void give_back(Environment host) {
    _mm_setcsr(host);
}

#elif defined(__aarch64__)

typedef struct {
    uint64_t control, flags;
} Environment;

static inline Environment hold(void) {
    Environment host;
    __asm__ volatile("mrs %0, fpcr\n\tmrs %1, fpsr\n\tmsr fpcr, xzr" : "=r"(host.control), "=r"(host.flags) : : "memory");
    return host;
}

static inline void give_back(Environment host) {
    __asm__ volatile("msr fpcr, %0\n\tmsr fpsr, %1" : : "r"(host.control), "r"(host.flags) : "memory");
}

#else

typedef int Environment;

static inline Environment hold(void) {
    return 0;
}

static inline void give_back(Environment host) {
    (void)host;
}

#endif

#if defined(__GNUC__)
#define APART __attribute__((noinline))
#elif defined(_MSC_VER)
#define APART __declspec(noinline)
#else
#define APART
#endif

#endif
