/* Times the steps of components that are taken in turn. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */

#include <stddef.h>
#include <time.h>

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Return what a step of all costs in s of the processor's time, or -1 if one fails. */
__attribute__((visibility("default"))) double in_turn(int (*const *step)(size_t), size_t n_components, size_t steps) {
    double begin = now();
    for (size_t n = 0; n < steps; n++)
        for (size_t i = 0; i < n_components; i++)
            if (step[i](n))
                return -1;
    return (now() - begin) / (double)steps;
}
