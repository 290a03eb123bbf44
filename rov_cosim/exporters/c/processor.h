/* What is stepped, compiled twice on x86-64: for all processors, and for those with AVX (2011 on), whose instructions name a place
   for their result. They are fewer for the same operations, and the results are the same to the last bit. */
#ifndef PROCESSOR_H
#define PROCESSOR_H

#define TRACED_ARGUMENTS const double **arg, double **res, int *iw, double *w, int mem

#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>

static int has_avx;

/* By hand, for zig's runtime library tells __builtin_cpu_supports of no features. */
__attribute__((constructor)) static void look(void) {
    enum { SAVED = 6 }; /* by the operating system: the registers of SSE and AVX */
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_OSXSAVE) || !(c & bit_AVX))
        return;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    has_avx = (low & SAVED) == SAVED;
}

#define STEPPED static inline __attribute__((always_inline))
#define BY_PROCESSOR(name, body)                                                                                       \
    __attribute__((target("avx"))) static int name##_by_avx(TRACED_ARGUMENTS) {                                        \
        return body(arg, res, iw, w, mem);                                                                             \
    }                                                                                                                  \
    int name(TRACED_ARGUMENTS) {                                                                                       \
        return has_avx ? name##_by_avx(arg, res, iw, w, mem) : body(arg, res, iw, w, mem);                             \
    }

#else

#define STEPPED static
#define BY_PROCESSOR(name, body)                                                                                       \
    int name(TRACED_ARGUMENTS) {                                                                                       \
        return body(arg, res, iw, w, mem);                                                                             \
    }

#endif

#endif
