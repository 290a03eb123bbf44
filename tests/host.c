/* A host with a floating-point environment of its own: host LIBRARY GUID MODE FLAG N_OUTPUTS OUTPUT... REAL...

   MODE is plain, trap, flush or upward; FLAG a Boolean input to set, or -1; REAL the Real inputs to move. OUTPUT and REAL are value
   references, with :SIZE after those of arrays. It prints what each call answers and the outputs, to the last bit. FMI3 makes it a
   host of FMI 3.0, which answers in as many calls. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fenv.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef FMI3
#include "fmi3FunctionTypes.h"
#else
#include "fmi2FunctionTypes.h"
#endif

#ifdef __x86_64__
#include <xmmintrin.h>
#endif

enum { STEPS = 200, MOST = 64 };

typedef struct {
    unsigned references[MOST];
    size_t n, sizes[MOST], n_values;
} Variables;

static void *library;

#define CALL(name, ...) FUNCTION(name)(__VA_ARGS__) /* of a name that may be a macro */

#ifdef FMI3
#define FUNCTION(name) ((fmi3##name##TYPE *)dlsym(library, "fmi3" #name))
#define STATE(verb) verb##FMUState
#define STATE_SIZE SerializedFMUStateSize
#define DESERIALIZE DeserializeFMUState
typedef unsigned char Byte;

static void ignore(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text) {
    (void)e, (void)status, (void)category, (void)text;
}

static void *instantiate(const char *token) {
    return CALL(InstantiateCoSimulation, "host", token, NULL, false, true, false, false, NULL, 0, NULL, ignore, NULL);
}

static int set_up(void *c, double start) { /* a start time that is none would be refused by what follows */
    return isnan(start) ? (int)CALL(EnterInitializationMode, c, false, 0, start, false, 0) : 0;
}

static int enter(void *c) {
    return CALL(EnterInitializationMode, c, false, 0, 0, false, 0);
}

static int set_flag(void *c, unsigned flag) {
    const bool on = true;
    return CALL(SetBoolean, c, &flag, 1, &on, 1);
}

static int set_some(void *c, const Variables *v, size_t first, size_t n, const double *values) {
    size_t n_values = 0;
    for (size_t i = first; i < first + n; i++)
        n_values += v->sizes[i];
    return CALL(SetFloat64, c, &v->references[first], n, values, n_values);
}

static int get_all(void *c, const Variables *v, double *values) {
    return CALL(GetFloat64, c, v->references, v->n, values, v->n_values);
}

static int step(void *c, double time, double h) {
    bool event, terminate, early;
    double last;
    return CALL(DoStep, c, time, h, true, &event, &terminate, &early, &last);
}

static int derive(void *c, const Variables *of, const Variables *by, const double *change, double *result) {
    return CALL(GetDirectionalDerivative, c, of->references, of->n, by->references, by->n, change, by->n_values, result, of->n_values);
}
#else
#define FUNCTION(name) ((fmi2##name##TYPE *)dlsym(library, "fmi2" #name))
#define STATE(verb) verb##FMUstate
#define STATE_SIZE SerializedFMUstateSize
#define DESERIALIZE DeSerializeFMUstate
typedef char Byte;

static void ignore(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...) {
    (void)e, (void)name, (void)status, (void)category, (void)text;
}

static void *instantiate(const char *guid) {
    static const fmi2CallbackFunctions callbacks = {ignore, calloc, free, NULL, NULL};
    return CALL(Instantiate, "host", fmi2CoSimulation, guid, NULL, &callbacks, fmi2False, fmi2True);
}

static int set_up(void *c, double start) {
    return CALL(SetupExperiment, c, 0, 0, start, 0, 0);
}

static int enter(void *c) {
    return CALL(EnterInitializationMode, c);
}

static int set_flag(void *c, unsigned flag) {
    const int on = 1;
    return CALL(SetBoolean, c, &flag, 1, &on);
}

static int set_some(void *c, const Variables *v, size_t first, size_t n, const double *values) {
    return CALL(SetReal, c, &v->references[first], n, values);
}

static int get_all(void *c, const Variables *v, double *values) {
    return CALL(GetReal, c, v->references, v->n, values);
}

static int step(void *c, double time, double h) {
    return CALL(DoStep, c, time, h, 1);
}

static int derive(void *c, const Variables *of, const Variables *by, const double *change, double *result) {
    return CALL(GetDirectionalDerivative, c, of->references, of->n, by->references, by->n, change, result);
}
#endif

static void flush(void) {
#ifdef __x86_64__
    _mm_setcsr(_mm_getcsr() | 0x8040); /* denormals are zeros, going in and coming out */
#elif defined(__aarch64__)
    __asm__ volatile("msr fpcr, %0" : : "r"(1ul << 24));
#endif
}

static Variables read_variables(char **arguments, size_t n) {
    Variables v = {.n = n};
    for (size_t i = 0; i < n; i++) {
        v.sizes[i] = 1;
        sscanf(arguments[i], "%u:%zu", &v.references[i], &v.sizes[i]);
        v.n_values += v.sizes[i];
    }
    return v;
}

#define NOTE(...) (answers[n_answers++] = (__VA_ARGS__))

int main(int argc, char **argv) {
    static double times[STEPS], inputs[STEPS][MOST], outputs[STEPS][MOST], change[MOST], derivatives[MOST];
    static int answers[64];
    size_t n_out = (size_t)atoi(argv[5]), n_answers = 0, size = 0;
    const Variables out = read_variables(argv + 6, n_out), reals = read_variables(argv + 6 + n_out, (size_t)argc - 6 - n_out);
    double far[MOST], not_a_number[MOST], end = STEPS * 0.03;
    int flag = atoi(argv[4]);
    void *state = NULL;
    library = dlopen(argv[1], RTLD_NOW);
    if (!library)
        return puts(dlerror()), 1;
    for (size_t i = 0; i < MOST; i++)
        change[i] = 1.0, far[i] = 1e308, not_a_number[i] = NAN;
    for (int n = 0; n < STEPS; n++)
        times[n] = n * 0.03;
    for (int n = 0; n < STEPS; n++)
        for (size_t i = 0; i < reals.n_values; i++)
            inputs[n][i] = n ? 0.3 * sin(0.07 * n + (double)i) : 1e-310; /* from a denormal on */

    feclearexcept(FE_ALL_EXCEPT);
    if (!strcmp(argv[3], "trap"))
        feenableexcept(FE_ALL_EXCEPT);
    if (!strcmp(argv[3], "flush"))
        flush();
    if (!strcmp(argv[3], "upward"))
        fesetround(FE_UPWARD);
    int trapped = fegetexcept(), rounding = fegetround();

    void *c = instantiate(argv[2]);
    NOTE(set_up(c, NAN));
    NOTE(set_up(c, 0));
    if (flag >= 0)
        NOTE(set_flag(c, (unsigned)flag));
    NOTE(set_some(c, &reals, 0, reals.n, inputs[0]));
    NOTE(enter(c));
    NOTE(get_all(c, &out, outputs[0]));
    NOTE(CALL(ExitInitializationMode, c));
    for (int n = 0; n < STEPS; n++) {
        int failed = set_some(c, &reals, 0, reals.n, inputs[n]) | step(c, times[n], 0.03) | get_all(c, &out, outputs[n]);
        answers[n_answers] |= failed;
    }
    n_answers++;
    NOTE(derive(c, &out, &reals, change, derivatives));
    NOTE(set_some(c, &reals, 0, 1, not_a_number));
    NOTE(step(c, end, NAN));
    NOTE(step(c, NAN, 0.03));
    NOTE(CALL(STATE(Get), c, &state));
    NOTE(CALL(STATE_SIZE, c, state, &size));
    Byte *bytes = malloc(size);
    NOTE(CALL(STATE(Serialize), c, state, bytes, size));
    memcpy(bytes + size / 2 / 8 * 8, not_a_number, sizeof *not_a_number);
    NOTE(CALL(DESERIALIZE, c, bytes, size, &state));
    int refused = 0;
    for (size_t i = 0; i < reals.n; i++)
        refused |= set_some(c, &reals, i, 1, far);
    NOTE(refused);
    NOTE(step(c, end, 0.03)); /* whose result is beyond all numbers */
    NOTE(CALL(STATE(Set), c, state));
    NOTE(step(c, end, 0.03));
    int kept = fegetexcept() == trapped && fegetround() == rounding && !fetestexcept(FE_ALL_EXCEPT);

    fesetenv(FE_DFL_ENV);
    printf("%s\n", kept ? "kept" : "changed");
    for (size_t i = 0; i < n_answers; i++)
        printf("%d ", answers[i]);
    for (int n = 0; n < STEPS; n++)
        for (size_t i = 0; i < out.n_values; i++)
            printf("%s%a", i ? " " : "\n", outputs[n][i]);
    for (size_t i = 0; i < out.n_values; i++)
        printf("%s%a", i ? " " : "\n", derivatives[i]);
    puts("");
    return 0;
}
