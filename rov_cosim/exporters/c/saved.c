/* Save and restore: fingerprint, checksum, state, parts. */
#include <math.h>
#include <string.h>

#include "instance.h"

enum { CHECKSUM_AT = sizeof fingerprint, STATE_AT = CHECKSUM_AT + sizeof(uint64_t) };

/* FNV-1a (Fowler, Noll, Vo), of 64 bits. */
uint64_t checksum(const State *state) {
    const unsigned char *bytes = (const unsigned char *)state;
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < sizeof *state; i++)
        hash = (hash ^ bytes[i]) * UINT64_C(0x100000001b3);
    return hash;
}

size_t saved_size(const Instance *instance) {
    return SAVED_SIZE + size_of_parts(instance);
}

int save(Instance *instance, char *bytes) {
    uint64_t sum = checksum(&instance->now);
    memcpy(bytes, fingerprint, sizeof fingerprint);
    memcpy(&bytes[CHECKSUM_AT], &sum, sizeof sum);
    memcpy(&bytes[STATE_AT], &instance->now, sizeof instance->now);
    return save_parts(instance, &bytes[SAVED_SIZE]);
}

int plausible(const State *state) {
    static const double LARGEST_INTEGER = 2147483647.0;
    int64_t phase = state->phase;
    int fine = phase > 0 && phase <= FAILED && !(phase & (phase - 1));
    fine = fine && isfinite(state->time) && isfinite(state->skew) && isfinite(state->start_time) && state->stop_time >= state->start_time;
    for (int i = 0; i < N_VARIABLES && fine; i++) {
        double value = state->values[i];
        int whole = value == floor(value) && fabs(value) <= LARGEST_INTEGER;
        fine = legal(i, value) && (variables[i].type == REAL || whole);
    }
    return fine;
}

int is_own(Instance *instance, const char *bytes) {
    if (!memcmp(bytes, fingerprint, sizeof fingerprint))
        return 1;
    say(instance->message, "The saved state is of another component, or of another version of this one.");
    return 0;
}

int is_saved(Instance *instance, const char *bytes) {
    State state;
    uint64_t sum;
    if (!is_own(instance, bytes)) /* first, for that of another component may be shorter */
        return 0;
    memcpy(&sum, &bytes[CHECKSUM_AT], sizeof sum);
    memcpy(&state, &bytes[STATE_AT], sizeof state);
    if (sum != checksum(&state) || !possible(&state)) {
        say(instance->message, "The saved state is damaged: it is not what this component has saved.");
        return 0;
    }
    return are_parts(instance, &bytes[SAVED_SIZE]);
}

int restore(Instance *instance, const char *bytes) {
    if (!is_saved(instance, bytes))
        return 0;
    memcpy(&instance->now, &bytes[STATE_AT], sizeof instance->now);
    return restore_parts(instance, &bytes[SAVED_SIZE]);
}
