/* A libFuzzer harness: bytes become FMI calls, right and wrong, on a few instances of the component it is linked with, or of
   the system (SYSTEM), by either version of FMI (FMI3).

   Left out is what C cannot check: pointers to what is no instance or no saved state, and arrays shorter than told. */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef FMI3
#include "fmi3Functions.h"
#include "fmi3_arrays.h"
#else
#include "fmi2Functions.h"
#endif
#include "slave.h"
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

/* Arguments: n references, and n_values of the rest. */
typedef struct {
    size_t n, n_values;
    uint32_t *vr;
    double *reals;
    int *ints;
    const char **names;
} List;

static const uint8_t *data, *data_end;
static void *instances[INSTANCES];
static Saved known[INSTANCES];    /* what each was after its last call */
static int all_logged[INSTANCES]; /* whether all its messages are sure to be logged */
static int told[REFUSED + 1];     /* how many messages the call logged, by status */
static void *slots[SLOTS], *view;
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

static void heed(const void *environment, int status, const char *category, const char *message) {
    const char *end = memchr(message, 0, MESSAGE_SIZE);
    EXPECT(environment == told && end > message && !strpbrk(message, "%#"));
    EXPECT(!strcmp(category, log_categories[status - WARNING]));
    told[status]++;
}

static int after(int k, int status);
static List list(Type type, unsigned first, unsigned n_range);

#ifdef FMI3
#include "fuzz_fmi3.h"
#else
#include "fuzz_fmi2.h"
#endif

/* Most of the references are of the type and among the n_range from the first, and most have a value for each element. */
static List list(Type type, unsigned first, unsigned n_range) {
    const char *const names[] = {log_categories[0], log_categories[1], log_categories[2], "%n", NULL};
    size_t n = byte() % 6, n_values = 0, at = 0;
    uint32_t *vr = take(n, sizeof *vr);
    for (size_t i = 0; i < n; i++) {
        unsigned kind = byte(), r = below(n_range);
        for (unsigned tries = 0; tries < n_range && variables[first + r].type != type; tries++)
            r = (r + 1) % n_range;
        vr[i] = kind == 255 ? UINT_MAX : kind == 254 ? N_VARIABLES : kind > 249 ? below(N_VARIABLES) : first_of(first + r);
        n_values += size_from(vr[i]);
    }
    if (n_values > n && byte() % 16 == 0)
        n_values = below(2 * (unsigned)n_values);
    size_t room = n > n_values ? n : n_values;
    List a = {n, n_values, vr, take(room, sizeof *a.reals), take(room, sizeof *a.ints), take(room, sizeof *a.names)};
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < size_from(vr[i]) && at < n_values; j++, at++) {
            double sane = vr[i] < N_VARIABLES ? variables[vr[i] + j].start : 0;
            a.reals[at] = size_from(vr[i]) > 1 && byte() % 4 ? sane : real(sane);
            a.ints[at] = fabs(a.reals[at]) < INT_MAX ? (int)a.reals[at] : INT_MIN;
            a.names[at] = names[byte() % 5];
        }
    }
    return (List){n, n_values, or_null(vr), or_null(a.reals), or_null(a.ints), or_null(a.names)};
}

static double value_of(void *c, uint32_t reference) {
    uint32_t vr = first_of(reference);
    size_t n = size_from(vr);
    double values[N_VARIABLES];
    int wholes[N_VARIABLES];
    EXPECT(get(c, variables[vr].type, (List){1, n, &vr, values, wholes, NULL}) == OK);
    return variables[vr].type == REAL ? values[reference - vr] : wholes[reference - vr];
}

/* Set one element as a Real. */
static int put(void *c, uint32_t reference, double value) {
    uint32_t vr = first_of(reference);
    size_t n = size_from(vr);
    double values[N_VARIABLES];
    for (uint32_t i = 0; i < n; i++)
        values[i] = vr + i == reference ? value : value_of(c, vr + i);
    return set(c, REAL, (List){1, n, &vr, values, NULL, NULL});
}

/* Check what holds after any call: a refusal is told and changed nothing, and no other instance ever changed. */
static int after(int k, int status) {
    EXPECT(instances[k] ? status <= REFUSED : status == REFUSED);
    for (int level = DISCARD; level <= REFUSED; level++)
        EXPECT(told[level] <= (level == status) && (!all_logged[k] || told[level] == (level == status)));
    for (int i = 0; i < INSTANCES; i++) {
        static Saved now;
        if (!instances[i])
            continue;
        EXPECT(getState(instances[i], &view) == OK);
        EXPECT(serializeState(instances[i], view, (char *)&now, sizeof now) == OK);
        if (i == k)
            excuse(&now.state, &known[k].state);
        EXPECT((i == k && (status == OK || has_failed(&now.state))) || is_same(&now, &known[i]));
        known[i] = now;
    }
    for (int r = 0; instances[k] && r < N_VARIABLES; r++) {
        if (r == N_U && known[k].state.phase < RUNNING)
            r = FIRST_PARAMETER; /* the outputs depend on the inputs and parameters then, which may not allow any */
        double value = value_of(instances[k], (uint32_t)r);
        EXPECT(isfinite(value) && value >= variables[r].minimum && value <= variables[r].maximum);
    }
    memset(told, 0, sizeof told);
    return status;
}

static void instantiate(int k, int sane) {
    const char *const names[] = {"one", "%s#n#", "", NULL}, *const guids[] = {guid, "%n{}", "", NULL};
    const char *name = names[sane ? 0 : byte() % 4], *known_guid = guids[sane || byte() % 8 ? 0 : byte() % 4];
    int logged = sane || byte() % 4, fine = name && *name && known_guid == guid, has_logger;
    freeInstance(instances[k]);
    instances[k] = new_instance(sane, name, known_guid, logged, &fine, &has_logger);
    EXPECT(!instances[k] == !fine);
    EXPECT(told[REFUSED] == (!fine && has_logger));
    memset(told, 0, sizeof told);
    all_logged[k] = instances[k] && logged && has_logger;
    if (instances[k]) {
        EXPECT(getState(instances[k], &view) == OK);
        EXPECT(stateSize(instances[k], view, &saved_bytes) == OK && saved_bytes <= sizeof(Saved));
    }
    after(k, instances[k] ? OK : REFUSED);
}

static int step(int k, double time, double size) {
    void *c = instances[k];
    const Saved before = known[k];
    const State *now = &before.state;
    double n = c ? steps_of(now, time, size) : 0;
    void *begin = NULL;
    if (n > AFFORDABLE && n <= MOST_INTERNAL_STEPS)
        return OK; /* it would only take long */
    EXPECT(!c || getState(c, &begin) == OK);
    int status = after(k, do_step_of(c, time, size));
    if (status == OK) {
        const Saved first = known[k];
        double slack = 1e-8 + 1e-6 * fabs(now->time) + 1e-6 * fabs(now->start_time); /* more than is granted */
        EXPECT(fabs(first.state.time + first.state.skew - (time + size)) <= slack);
        EXPECT(fabs(time - (now->time + now->skew)) <= slack && time + size <= now->stop_time + slack);
        EXPECT(after(k, setState(c, begin)) == OK && is_same(&known[k], &before));
        EXPECT(after(k, do_step_of(c, time, size)) == OK && is_same(&known[k], &first));
    }
    EXPECT(!c || freeState(c, &begin) == OK);
    return status;
}

/* From the start values all goes well; random calls alone seldom come as far. */
static void run(int k, int stage) {
    const State *now = &known[k].state;
    EXPECT(after(k, resetInstance(instances[k])) == OK);
    EXPECT(stage < 1 || after(k, enter_at(k, byte() / 8.0)) == OK);
    EXPECT(stage < 2 || after(k, exitInitialization(instances[k])) == OK);
    for (int i = stage < 2 ? 0 : byte() % 8; i > 0; i--)
        EXPECT(step(k, now->time, (1 + byte() % 8) / (ROOM > 8 ? 1.0 : 4.0) * period(now)) == OK);
}

/* One parameter far from sane: in a list of many such values one is illegal, and none is set. */
static void strain(int k) {
    uint32_t vr = FIRST_PARAMETER + below(N_VARIABLES - FIRST_PARAMETER);
    double value = byte() % 2 ? 1e30 : -1e30;
    run(k, 1);
    after(k, put(instances[k], vr, value));
    after(k, exitInitialization(instances[k]));
    step(k, known[k].state.time, period(&known[k].state));
}

/* Carry a state through bytes, some of which may be lost or changed. */
static void carry(int k, void *slot, void **to) {
    void *c = instances[k];
    size_t size = 0, n = byte() % 8 ? saved_bytes : below(2 * (unsigned)saved_bytes);
    char *bytes = take(n, 1);
    EXPECT(after(k, stateSize(c, slot, or_null(&size))) != OK || size == saved_bytes);
    after(k, serializeState(c, slot, or_null(bytes), n));
    for (int i = byte() % 4; i > 0 && n >= saved_bytes; i--) {
        double value = real(0);
        int64_t whole = byte() - 1;
        memcpy(&bytes[below((unsigned)saved_bytes / 8) * 8], byte() % 2 ? (void *)&value : (void *)&whole, 8);
    }
    if (n >= saved_bytes && byte() % 4) /* who damages a state on purpose mends its checksum */
        ((Saved *)(void *)bytes)->checksum = checksum(&((Saved *)(void *)bytes)->state);
    if (after(k, deserializeState(c, or_null(bytes), n, or_null(to))) == OK)
        EXPECT(n == saved_bytes && !memcmp(bytes, fingerprint, sizeof fingerprint));
}

static void put_back(int k, void *slot) {
    static Saved wanted;
    int fine = slot && instances[k];
    EXPECT(!fine || serializeState(instances[k], slot, (char *)&wanted, sizeof wanted) == OK);
    EXPECT((after(k, setState(instances[k], slot)) == OK) == fine);
    EXPECT(!fine || is_same(&known[k], &wanted));
}

static void operate(int k, unsigned operation) {
    static const Type types[] = {REAL, REAL, REAL, REAL, REAL, INTEGER, BOOLEAN, STRING};
    if (!instances[k] && byte() % 8)
        instantiate(k, 1);
    void *c = instances[k], **slot = &slots[byte() % SLOTS];
    const State *now = &known[k].state;
    Type type = types[byte() % 8];
    List a, b;
    if (c && !*slot && byte() % 2)
        after(k, getState(c, slot));
    operation %= 20 + OWN;
    switch (operation) {
    case 0: instantiate(k, 0); break;
    case 1: freeInstance(c), instances[k] = NULL, all_logged[k] = 0; break;
    case 2: c ? run(k, byte() % 4) : (void)0; break;
    case 3: after(k, enter(c)); break;
    case 4: after(k, exitInitialization(c)); break;
    case 5: after(k, terminateRun(c)); break;
    case 6: after(k, resetInstance(c)); break;
    case 7: step(k, real(now->time), real(0.01)); break;
    case 8: case 9: step(k, now->time + now->skew, real(period(now))); break;
    case 10: a = list(type, 0, N_VARIABLES), after(k, get(c, type, a)); break;
    case 11: case 12:
        a = list(type, 0, operation == 11 ? N_U : N_VARIABLES);
        if (after(k, set(c, type, a)) == OK && type == REAL && a.n)
            EXPECT(value_of(c, a.vr[a.n - 1] + (uint32_t)size_from(a.vr[a.n - 1]) - 1) == a.reals[a.n_values - 1]);
        break;
    case 13: after(k, getState(c, or_null(slot))); break;
    case 14: put_back(k, *slot); break;
    case 15: after(k, freeState(c, or_null(slot))); break;
    case 16: carry(k, *slot, &slots[byte() % SLOTS]); break;
    case 17:
        a = list(REAL, 0, N_VARIABLES);
        if (after(k, setDebugLogging(c, byte() % 4, a.n, a.names)) == OK)
            all_logged[k] = 0;
        break;
    case 18:
        a = list(REAL, 0, N_U + 1), b = list(REAL, N_U - 1, N_Y + 2);
        if (after(k, derivative(c, b, a, b.reals)) == OK)
            for (size_t i = 0; i < b.n_values; i++)
                EXPECT(isfinite(b.reals[i]));
        break;
    case 19: c ? strain(k) : (void)0; break;
    default: own(k, operation - 20);
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
        freeState(instances[0], &slots[i]);
    freeState(instances[0], &view);
    for (int k = 0; k < INSTANCES; k++)
        freeInstance(instances[k]), instances[k] = NULL, all_logged[k] = 0;
    return 0;
}
