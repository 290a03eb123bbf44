/* FMI 2.0: save and restore. */
#include <stdlib.h>
#include <string.h>

#include "slave.h"

/* Whether there is memory for a state, new or that of an earlier one. */
static int allocated(Slave *slave, fmi2FMUstate *state) {
    if (*state)
        return checked(slave, is_own(&slave->instance, *state)) == fmi2OK;
    *state = malloc(saved_size(&slave->instance));
    if (!*state)
        refuse(slave, "There is no memory for a saved state.");
    return *state != NULL;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    Slave *slave = called(c, GET_STATE);
    if (!slave || !given(slave, GET_STATE, state, "FMUstate"))
        return fmi2Error;
    if (!allocated(slave, state))
        return fmi2Error;
    return checked(slave, save(&slave->instance, *state));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    Slave *slave = called(c, SET_STATE);
    if (!slave || !given(slave, SET_STATE, state, "FMUstate"))
        return fmi2Error;
    return HELD(slave, restore(&slave->instance, state));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    Slave *slave = called(c, FREE_STATE);
    if (!slave)
        return fmi2Error;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    Slave *slave = called(c, STATE_SIZE);
    if (!slave || !given(slave, STATE_SIZE, state, "FMUstate") || !given(slave, STATE_SIZE, size, "size"))
        return fmi2Error;
    *size = saved_size(&slave->instance);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    Slave *slave = called(c, SERIALIZE);
    if (!slave || !given(slave, SERIALIZE, state, "FMUstate") || !given(slave, SERIALIZE, bytes, "serializedState"))
        return fmi2Error;
    if (!is_own(&slave->instance, state))
        return report(slave, fmi2Error);
    size_t expected = saved_size(&slave->instance);
    if (size < expected)
        return refuse(slave, "There is room for %lu bytes; expected %lu.", (unsigned long)size, (unsigned long)expected);
    memcpy(bytes, state, expected);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    Slave *slave = called(c, DESERIALIZE);
    if (!slave || !given(slave, DESERIALIZE, bytes, "serializedState")
        || !given(slave, DESERIALIZE, state, "FMUstate"))
        return fmi2Error;
    size_t expected = saved_size(&slave->instance);
    if (size != expected)
        return refuse(slave, "The saved state has %lu bytes; expected %lu.", (unsigned long)size, (unsigned long)expected);
    if (HELD(slave, is_saved(&slave->instance, bytes)) != fmi2OK)
        return fmi2Error;
    if (!allocated(slave, state))
        return fmi2Error;
    memcpy(*state, bytes, expected);
    return fmi2OK;
}
