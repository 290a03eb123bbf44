/* Save and restore, as both versions of FMI ask for it. */
#include <stdlib.h>
#include <string.h>

#include "slave.h"

static const char STATE[] = "FMUstate", BYTES[] = "serializedState";

/* Whether there is memory for a state, new or that of an earlier one. */
static int allocated(Slave *slave, void **state) {
    if (*state)
        return checked(slave, is_own(&slave->instance, *state)) == OK;
    *state = malloc(saved_size(&slave->instance));
    if (!*state)
        refuse(slave, "There is no memory for a saved state.");
    return *state != NULL;
}

int get_state(void *component, void **state) {
    Slave *slave = called(component, GET_STATE);
    if (!slave || !given(slave, GET_STATE, state, STATE) || !allocated(slave, state))
        return REFUSED;
    return checked(slave, save(&slave->instance, *state));
}

int set_state(void *component, const void *state) {
    Slave *slave = called(component, SET_STATE);
    if (!slave || !given(slave, SET_STATE, state, STATE))
        return REFUSED;
    return HELD(slave, restore(&slave->instance, state));
}

int free_state(void *component, void **state) {
    if (!called(component, FREE_STATE))
        return REFUSED;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return OK;
}

int state_size(void *component, const void *state, size_t *size) {
    Slave *slave = called(component, STATE_SIZE);
    if (!slave || !given(slave, STATE_SIZE, state, STATE) || !given(slave, STATE_SIZE, size, "size"))
        return REFUSED;
    *size = saved_size(&slave->instance);
    return OK;
}

int serialize(void *component, const void *state, void *bytes, size_t size) {
    Slave *slave = called(component, SERIALIZE);
    if (!slave || !given(slave, SERIALIZE, state, STATE) || !given(slave, SERIALIZE, bytes, BYTES))
        return REFUSED;
    if (!is_own(&slave->instance, state))
        return report(slave, REFUSED);
    size_t expected = saved_size(&slave->instance);
    if (size < expected)
        return refuse(slave, "There is room for %lu bytes; expected %lu.", (unsigned long)size, (unsigned long)expected);
    memcpy(bytes, state, expected);
    return OK;
}

int deserialize(void *component, const void *bytes, size_t size, void **state) {
    Slave *slave = called(component, DESERIALIZE);
    if (!slave || !given(slave, DESERIALIZE, bytes, BYTES) || !given(slave, DESERIALIZE, state, STATE))
        return REFUSED;
    size_t expected = saved_size(&slave->instance);
    if (size != expected)
        return refuse(slave, "The saved state has %lu bytes; expected %lu.", (unsigned long)size, (unsigned long)expected);
    if (HELD(slave, is_saved(&slave->instance, bytes)) != OK || !allocated(slave, state))
        return REFUSED;
    memcpy(*state, bytes, expected);
    return OK;
}
