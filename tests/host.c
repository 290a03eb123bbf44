/* A host with a floating-point environment of its own: host LIBRARY GUID MODE FIRST_OUTPUT N_OUTPUTS FLAG REAL...

   MODE is plain, trap, flush or upward; FLAG a Boolean input to set, or -1; REAL the value references of the Real inputs to move.
   It prints what each call answers and the outputs, to the last bit. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fenv.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

#ifdef __x86_64__
#include <xmmintrin.h>
#endif

enum { STEPS = 200, MOST = 64 };

static void flush(void) {
#ifdef __x86_64__
    _mm_setcsr(_mm_getcsr() | 0x8040); /* denormals are zeros, going in and coming out */
#elif defined(__aarch64__)
    __asm__ volatile("msr fpcr, %0" : : "r"(1ul << 24));
#endif
}

static void ignore(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...) {
    (void)e, (void)name, (void)status, (void)category, (void)text;
}

#define CALL(name, ...) ((fmi2##name##TYPE *)dlsym(library, "fmi2" #name))(__VA_ARGS__)
#define NOTE(...) (answers[n_answers++] = (__VA_ARGS__))

int main(int argc, char **argv) {
    static double times[STEPS], inputs[STEPS][MOST], outputs[STEPS][MOST], change[MOST], derivatives[MOST];
    static int answers[32];
    fmi2ValueReference reals[MOST], all[MOST], flag = (fmi2ValueReference)atoi(argv[6]);
    fmi2CallbackFunctions callbacks = {ignore, calloc, free, NULL, NULL};
    size_t n_reals = (size_t)argc - 7, n_outputs = (size_t)atoi(argv[5]), n_answers = 0, size = 0;
    double far = 1e308, not_a_number = NAN, end = STEPS * 0.03;
    int on = 1, is_flag = flag < 1000;
    fmi2FMUstate state = NULL;
    void *library = dlopen(argv[1], RTLD_NOW);
    if (!library)
        return puts(dlerror()), 1;
    for (size_t i = 0; i < n_reals; i++)
        reals[i] = (fmi2ValueReference)atoi(argv[7 + i]), change[i] = 1.0;
    for (size_t i = 0; i < n_outputs; i++)
        all[i] = (fmi2ValueReference)(atoi(argv[4]) + (int)i);
    for (int n = 0; n < STEPS; n++)
        times[n] = n * 0.03;
    for (int n = 0; n < STEPS; n++)
        for (size_t i = 0; i < n_reals; i++)
            inputs[n][i] = n ? 0.3 * sin(0.07 * n + (double)i) : 1e-310; /* from a denormal on */

    feclearexcept(FE_ALL_EXCEPT);
    if (!strcmp(argv[3], "trap"))
        feenableexcept(FE_ALL_EXCEPT);
    if (!strcmp(argv[3], "flush"))
        flush();
    if (!strcmp(argv[3], "upward"))
        fesetround(FE_UPWARD);
    int trapped = fegetexcept(), rounding = fegetround();

    fmi2Component c = CALL(Instantiate, "host", fmi2CoSimulation, argv[2], NULL, &callbacks, fmi2False, fmi2True);
    NOTE(CALL(SetupExperiment, c, 0, 0, not_a_number, 0, 0));
    NOTE(CALL(SetupExperiment, c, 0, 0, 0, 0, 0));
    if (is_flag)
        NOTE(CALL(SetBoolean, c, &flag, 1, &on));
    NOTE(CALL(SetReal, c, reals, n_reals, inputs[0]));
    NOTE(CALL(EnterInitializationMode, c));
    NOTE(CALL(GetReal, c, all, n_outputs, outputs[0]));
    NOTE(CALL(ExitInitializationMode, c));
    for (int n = 0; n < STEPS; n++) {
        int failed = CALL(SetReal, c, reals, n_reals, inputs[n]) | CALL(DoStep, c, times[n], 0.03, 1)
            | CALL(GetReal, c, all, n_outputs, outputs[n]);
        answers[n_answers] |= failed;
    }
    n_answers++;
    NOTE(CALL(GetDirectionalDerivative, c, all, n_outputs, reals, 1, change, derivatives));
    NOTE(CALL(SetReal, c, reals, 1, &not_a_number));
    NOTE(CALL(DoStep, c, end, not_a_number, 1));
    NOTE(CALL(DoStep, c, not_a_number, 0.03, 1));
    NOTE(CALL(GetFMUstate, c, &state));
    NOTE(CALL(SerializedFMUstateSize, c, state, &size));
    char *bytes = malloc(size);
    NOTE(CALL(SerializeFMUstate, c, state, bytes, size));
    memcpy(bytes + size / 2 / 8 * 8, &not_a_number, sizeof not_a_number);
    NOTE(CALL(DeSerializeFMUstate, c, bytes, size, &state));
    for (size_t i = 0; i < n_reals; i++)
        NOTE(CALL(SetReal, c, &reals[i], 1, &far));
    NOTE(CALL(DoStep, c, end, 0.03, 1)); /* whose result is beyond all numbers */
    NOTE(CALL(SetFMUstate, c, state));
    NOTE(CALL(DoStep, c, end, 0.03, 1));
    int kept = fegetexcept() == trapped && fegetround() == rounding && !fetestexcept(FE_ALL_EXCEPT);

    fesetenv(FE_DFL_ENV);
    printf("%s\n", kept ? "kept" : "changed");
    for (size_t i = 0; i < n_answers; i++)
        printf("%d ", answers[i]);
    for (int n = 0; n < STEPS; n++)
        for (size_t i = 0; i < n_outputs; i++)
            printf("%s%a", i ? " " : "\n", outputs[n][i]);
    for (size_t i = 0; i < n_outputs; i++)
        printf("%s%a", i ? " " : "\n", derivatives[i]);
    puts("");
    return 0;
}
