/* A libFuzzer harness: bytes become FMI calls, right and wrong, on a few instances of the component it is linked with, or of
   the system.

   Left out is what C cannot check: pointers to what is no instance or no saved state, and arrays shorter than told. */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "instance.h"
#ifndef SYSTEM
#include "stepping.h"
#endif

#define EXPECT(fine) ((fine) ? (void)0 : (fprintf(stderr, "fuzz.c:%d: expected %s\n", __LINE__, #fine), abort()))

enum { INSTANCES = 2, SLOTS = 4, AFFORDABLE = 30 };

#ifdef SYSTEM
enum { ROOM = 1 << 16 }; /* for the states of the elements */
extern const double inner_step;

static double period(const State *now) {
    return (void)now, inner_step;
}

static double steps_of(const State *now, double time, double size) {
    return (void)now, (void)time, size / inner_step;
}

/* An element refused an inner step that others took: only a reset or a restored state helps. */
static int has_failed(const State *now) {
    return now->phase == FAILED;
}

static void excuse(const State *now, State *known) {
    (void)now, (void)known;
}
#else
enum { ROOM = 8 };

static double period(const State *now) {
    return now->values[FIRST_PARAMETER + INTERNAL_STEP];
}

static double steps_of(const State *now, double time, double size) {
    Result result = {.samples = now->samples};
    Conditions at = {now->values, now->u_rate, &now->values[FIRST_PARAMETER], now->constants,
                     now->start_time, time};
    return internal_steps(&result, &at, size);
}

static int has_failed(const State *now) {
    return (void)now, 0;
}

/* A refused call too may find that the parameters are fine: they stay so, and what follows from them is known. */
static void excuse(const State *now, State *known) {
    if (!now->unchecked) {
        known->unchecked = 0;
        memcpy(known->constants, now->constants, sizeof known->constants);
    }
}
#endif

typedef struct {
    unsigned char fingerprint[sizeof fingerprint];
    uint64_t checksum;
    State state;
    char parts[ROOM];
} Saved;

static int is_same(const Saved *a, const Saved *b) {
    return !memcmp(&a->state, &b->state, sizeof a->state) && !memcmp(a->parts, b->parts, sizeof a->parts);
}

/* Arguments: n of each. */
typedef struct {
    size_t n;
    fmi2ValueReference *vr;
    double *reals;
    int *ints;
    const char **names;
} List;

static const uint8_t *data, *data_end;
static fmi2Component instances[INSTANCES];
static Saved known[INSTANCES];    /* what each was after its last call */
static int all_logged[INSTANCES]; /* whether all its messages are sure to be logged */
static int told[fmi2Error + 1];   /* how many messages the call logged, by status */
static fmi2FMUstate slots[SLOTS], view;
static void *taken[16]; /* memory for one operation */
static int n_taken;
static size_t saved_bytes; /* of a state */

static uint8_t byte(void) {
    return data < data_end ? *data++ : 0;
}

static unsigned below(unsigned n) {
    unsigned high = n > 256 ? byte() : 0;
    return (high << 8 | byte()) % n;
}

static void *or_null(void *pointer) {
    return byte() == 251 ? NULL : pointer;
}

/* Each array is alone on the heap: the sanitizer sees an access beyond it. */
static void *take(size_t n, size_t size) {
    return taken[n_taken++] = calloc(n, size);
}

static double real(double sane) {
    static const double odd[] = {NAN, INFINITY, -INFINITY, DBL_MAX, -DBL_MAX, 1e160, 5e-324, 1e-9, 2147483648.0, -0.0};
    uint8_t kind = byte(), raw[8];
    double any;
    if (kind < 200)
        return sane + (kind % 2 ? -1 : 1) * kind / 128.0 * fmax(1, fabs(sane));
    if (kind < 240)
        return odd[kind % (sizeof odd / sizeof *odd)];
    for (int i = 0; i < 8; i++)
        raw[i] = byte();
    memcpy(&any, raw, sizeof any);
    return any;
}

/* Most of the references are of the type and among the n_range from the first. */
static List list(Type type, unsigned first, unsigned n_range) {
    const char *const names[] = {log_categories[0], log_categories[1], log_categories[2], "%n", NULL};
    size_t n = byte() % 6;
    List a = {n, take(n, sizeof *a.vr), take(n, sizeof *a.reals), take(n, sizeof *a.ints), take(n, sizeof *a.names)};
    for (size_t i = 0; i < n; i++) {
        unsigned kind = byte(), r = below(n_range);
        for (unsigned tries = 0; tries < n_range && variables[first + r].type != type; tries++)
            r = (r + 1) % n_range;
        a.vr[i] = kind == 255 ? UINT_MAX : kind == 254 ? N_VARIABLES : kind > 249 ? below(N_VARIABLES) : first + r;
        a.reals[i] = real(variables[first + r].start);
        a.ints[i] = fabs(a.reals[i]) < INT_MAX ? (int)a.reals[i] : INT_MIN;
        a.names[i] = names[byte() % 5];
    }
    return (List){n, or_null(a.vr), or_null(a.reals), or_null(a.ints), or_null(a.names)};
}

static fmi2Status get(fmi2Component c, Type type, List a) {
    return type == REAL    ? fmi2GetReal(c, a.vr, a.n, a.reals)
         : type == INTEGER ? fmi2GetInteger(c, a.vr, a.n, a.ints)
         : type == BOOLEAN ? fmi2GetBoolean(c, a.vr, a.n, a.ints)
                           : fmi2GetString(c, a.vr, a.n, a.names);
}

static fmi2Status set(fmi2Component c, Type type, List a) {
    return type == REAL    ? fmi2SetReal(c, a.vr, a.n, a.reals)
         : type == INTEGER ? fmi2SetInteger(c, a.vr, a.n, a.ints)
         : type == BOOLEAN ? fmi2SetBoolean(c, a.vr, a.n, a.ints)
                           : fmi2SetString(c, a.vr, a.n, a.names);
}

static double value_of(fmi2Component c, fmi2ValueReference vr) {
    double value = NAN;
    int whole = 0;
    EXPECT(get(c, variables[vr].type, (List){1, &vr, &value, &whole, NULL}) == fmi2OK);
    return variables[vr].type == REAL ? value : whole;
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String message, ...) {
    const char *end = memchr(message, 0, MESSAGE_SIZE);
    EXPECT(environment == told && *name && end > message && !strpbrk(message, "%#"));
    EXPECT(!strcmp(category, log_categories[status - fmi2Warning]));
    told[status]++;
}

/* Check what holds after any call: a refusal is told and changed nothing, and no other instance ever changed. */
static fmi2Status after(int k, fmi2Status status) {
    EXPECT(instances[k] ? status <= fmi2Error : status == fmi2Error);
    for (int level = fmi2Discard; level <= fmi2Error; level++)
        EXPECT(told[level] <= (level == (int)status) && (!all_logged[k] || told[level] == (level == (int)status)));
    for (int i = 0; i < INSTANCES; i++) {
        static Saved now;
        if (!instances[i])
            continue;
        EXPECT(fmi2GetFMUstate(instances[i], &view) == fmi2OK);
        EXPECT(fmi2SerializeFMUstate(instances[i], view, (char *)&now, sizeof now) == fmi2OK);
        if (i == k)
            excuse(&now.state, &known[k].state);
        EXPECT((i == k && (status == fmi2OK || has_failed(&now.state))) || is_same(&now, &known[i]));
        known[i] = now;
    }
    for (int r = 0; instances[k] && r < N_VARIABLES; r++) {
        if (r == N_U && known[k].state.phase < RUNNING)
            r = FIRST_PARAMETER; /* the outputs depend on the inputs and parameters then, which may not allow any */
        double value = value_of(instances[k], (fmi2ValueReference)r);
        EXPECT(isfinite(value) && value >= variables[r].minimum && value <= variables[r].maximum);
    }
    memset(told, 0, sizeof told);
    return status;
}

static void instantiate(int k, int sane) {
    const char *const names[] = {"one", "%s#n#", "", NULL}, *const guids[] = {guid, "%n{}", "", NULL};
    const char *name = names[sane ? 0 : byte() % 4], *known_guid = guids[sane || byte() % 8 ? 0 : byte() % 4];
    fmi2CallbackFunctions functions = {sane || byte() % 16 ? log_message : NULL, calloc, free, NULL, told};
    fmi2CallbackFunctions *callbacks = sane ? &functions : or_null(&functions);
    int type = sane || byte() % 16 ? fmi2CoSimulation : byte() - 1, logged = sane || byte() % 4;
    int fine = name && *name && known_guid == guid && type == fmi2CoSimulation;
    fmi2FreeInstance(instances[k]);
    instances[k] = fmi2Instantiate(name, (fmi2Type)type, known_guid, NULL, callbacks, byte() % 2, logged);
    EXPECT(!instances[k] == !(fine && callbacks));
    EXPECT(told[fmi2Error] == (!fine && callbacks && functions.logger));
    memset(told, 0, sizeof told);
    all_logged[k] = instances[k] && logged && functions.logger;
    if (instances[k]) {
        EXPECT(fmi2GetFMUstate(instances[k], &view) == fmi2OK);
        EXPECT(fmi2SerializedFMUstateSize(instances[k], view, &saved_bytes) == fmi2OK && saved_bytes <= sizeof(Saved));
    }
    after(k, instances[k] ? fmi2OK : fmi2Error);
}

static fmi2Status step(int k, double time, double size) {
    fmi2Component c = instances[k];
    const Saved before = known[k];
    const State *now = &before.state;
    double n = c ? steps_of(now, time, size) : 0;
    fmi2FMUstate begin = NULL;
    if (n > AFFORDABLE && n <= MOST_INTERNAL_STEPS)
        return fmi2OK; /* it would only take long */
    EXPECT(!c || fmi2GetFMUstate(c, &begin) == fmi2OK);
    fmi2Status status = after(k, fmi2DoStep(c, time, size, fmi2False));
    if (status == fmi2OK) {
        const Saved first = known[k];
        double slack = 1e-8 + 1e-8 * fabs(now->time) + 1e-8 * fabs(now->start_time); /* more than is granted */
        EXPECT(first.state.time == time + size);
        EXPECT(fabs(time - now->time) <= slack && time + size <= now->stop_time + slack);
        EXPECT(after(k, fmi2SetFMUstate(c, begin)) == fmi2OK && is_same(&known[k], &before));
        EXPECT(after(k, fmi2DoStep(c, time, size, fmi2False)) == fmi2OK && is_same(&known[k], &first));
    }
    EXPECT(!c || fmi2FreeFMUstate(c, &begin) == fmi2OK);
    return status;
}

/* From the start values all goes well; random calls alone seldom come as far. */
static void run(int k, int stage) {
    const State *now = &known[k].state;
    EXPECT(after(k, fmi2Reset(instances[k])) == fmi2OK);
    EXPECT(after(k, fmi2SetupExperiment(instances[k], 0, 0, byte() / 8.0, 0, 0)) == fmi2OK);
    EXPECT(stage < 1 || after(k, fmi2EnterInitializationMode(instances[k])) == fmi2OK);
    EXPECT(stage < 2 || after(k, fmi2ExitInitializationMode(instances[k])) == fmi2OK);
    for (int i = stage < 2 ? 0 : byte() % 8; i > 0; i--)
        EXPECT(step(k, now->time, (1 + byte() % 8) / (ROOM > 8 ? 1.0 : 4.0) * period(now)) == fmi2OK);
}

/* One parameter far from sane: in a list of many such values one is illegal, and none is set. */
static void strain(int k) {
    fmi2ValueReference vr = FIRST_PARAMETER + below(N_VARIABLES - FIRST_PARAMETER);
    double value = byte() % 2 ? 1e30 : -1e30;
    run(k, 1);
    after(k, set(instances[k], REAL, (List){1, &vr, &value, NULL, NULL}));
    after(k, fmi2ExitInitializationMode(instances[k]));
    step(k, known[k].state.time, period(&known[k].state));
}

/* Carry a state through bytes, some of which may be lost or changed. */
static void serialize(int k, fmi2FMUstate slot, fmi2FMUstate *to) {
    fmi2Component c = instances[k];
    size_t size = 0, n = byte() % 8 ? saved_bytes : below(2 * (unsigned)saved_bytes);
    char *bytes = take(n, 1);
    EXPECT(after(k, fmi2SerializedFMUstateSize(c, slot, or_null(&size))) != fmi2OK || size == saved_bytes);
    after(k, fmi2SerializeFMUstate(c, slot, or_null(bytes), n));
    for (int i = byte() % 4; i > 0 && n >= saved_bytes; i--) {
        double value = real(0);
        int64_t whole = byte() - 1;
        memcpy(&bytes[below((unsigned)saved_bytes / 8) * 8], byte() % 2 ? (void *)&value : (void *)&whole, 8);
    }
    if (n >= saved_bytes && byte() % 4) /* who damages a state on purpose mends its checksum */
        ((Saved *)(void *)bytes)->checksum = checksum(&((Saved *)(void *)bytes)->state);
    if (after(k, fmi2DeSerializeFMUstate(c, or_null(bytes), n, or_null(to))) == fmi2OK)
        EXPECT(n == saved_bytes && !memcmp(bytes, fingerprint, sizeof fingerprint));
}

static void set_state(int k, fmi2FMUstate slot) {
    static Saved wanted;
    int fine = slot && instances[k];
    EXPECT(!fine || fmi2SerializeFMUstate(instances[k], slot, (char *)&wanted, sizeof wanted) == fmi2OK);
    EXPECT((after(k, fmi2SetFMUstate(instances[k], slot)) == fmi2OK) == fine);
    EXPECT(!fine || is_same(&known[k], &wanted));
}

static void operate(int k, unsigned operation) {
    static const Type types[] = {REAL, REAL, REAL, REAL, REAL, INTEGER, BOOLEAN, STRING};
    if (!instances[k] && byte() % 8)
        instantiate(k, 1);
    fmi2Component c = instances[k];
    const State *now = &known[k].state;
    fmi2FMUstate *slot = &slots[byte() % SLOTS];
    fmi2StatusKind kind = (fmi2StatusKind)(byte() % 5);
    Type type = types[byte() % 8];
    double time;
    fmi2Status status;
    List a, b;
    if (c && !*slot && byte() % 2)
        after(k, fmi2GetFMUstate(c, slot));
    operation %= 28;
    switch (operation) {
    case 0: instantiate(k, 0); break;
    case 1: fmi2FreeInstance(c), instances[k] = NULL, all_logged[k] = 0; break;
    case 2: c ? run(k, byte() % 4) : (void)0; break;
    case 3: after(k, fmi2SetupExperiment(c, byte() % 2, real(0), real(0), byte() % 2, real(0))); break;
    case 4: after(k, fmi2EnterInitializationMode(c)); break;
    case 5: after(k, fmi2ExitInitializationMode(c)); break;
    case 6: after(k, fmi2Terminate(c)); break;
    case 7: after(k, fmi2Reset(c)); break;
    case 8: step(k, real(now->time), real(0.01)); break;
    case 9: step(k, now->time, real(period(now))); break;
    case 10: a = list(type, 0, N_VARIABLES), after(k, get(c, type, a)); break;
    case 11: case 12:
        a = list(type, 0, operation == 11 ? N_U : N_VARIABLES);
        if (after(k, set(c, type, a)) == fmi2OK && type == REAL && a.n)
            EXPECT(value_of(c, a.vr[a.n - 1]) == a.reals[a.n - 1]);
        break;
    case 13: after(k, fmi2GetFMUstate(c, or_null(slot))); break;
    case 14: set_state(k, *slot); break;
    case 15: after(k, fmi2FreeFMUstate(c, or_null(slot))); break;
    case 16: serialize(k, *slot, &slots[byte() % SLOTS]); break;
    case 17:
        a = list(REAL, 0, N_VARIABLES);
        if (after(k, fmi2SetDebugLogging(c, byte() % 4, a.n, a.names)) == fmi2OK)
            all_logged[k] = 0;
        break;
    case 18: a = list(REAL, 0, N_U + 1), after(k, fmi2SetRealInputDerivatives(c, a.vr, a.n, a.ints, a.reals)); break;
    case 19: a = list(REAL, N_U, N_Y), after(k, fmi2GetRealOutputDerivatives(c, a.vr, a.n, a.ints, a.reals)); break;
    case 20:
        a = list(REAL, 0, N_U + 1), b = list(REAL, N_U - 1, N_Y + 2);
        if (after(k, fmi2GetDirectionalDerivative(c, b.vr, b.n, a.vr, a.n, a.reals, b.reals)) == fmi2OK)
            for (size_t i = 0; i < b.n; i++)
                EXPECT(isfinite(b.reals[i]));
        break;
    case 21: after(k, fmi2GetStatus(c, kind, &status)); break;
    case 22: EXPECT(after(k, fmi2GetRealStatus(c, kind, or_null(&time))) != fmi2OK || time == now->time); break;
    case 23: after(k, fmi2GetIntegerStatus(c, kind, &(int){0})); break;
    case 24: after(k, fmi2GetBooleanStatus(c, kind, or_null(&(int){0}))); break;
    case 25: after(k, fmi2GetStringStatus(c, kind, &(fmi2String){0})); break;
    case 26: after(k, fmi2CancelStep(c)); break;
    case 27: c ? strain(k) : (void)0; break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
    data = bytes, data_end = bytes + size;
    while (data < data_end) {
        operate(byte() % INSTANCES, byte());
        while (n_taken)
            free(taken[--n_taken]);
    }
    instantiate(0, 1); /* any instance can free all states */
    for (int i = 0; i < SLOTS; i++)
        fmi2FreeFMUstate(instances[0], &slots[i]);
    fmi2FreeFMUstate(instances[0], &view);
    for (int k = 0; k < INSTANCES; k++)
        fmi2FreeInstance(instances[k]), instances[k] = NULL, all_logged[k] = 0;
    return 0;
}
