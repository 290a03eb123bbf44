/* An instance behind FMI 2.0: who may call when, what is NULL, what is logged. */
#ifndef SLAVE_H
#define SLAVE_H

#include "fmi2Functions.h"
#include "instance.h"

typedef struct {
    Instance instance;
    fmi2CallbackFunctions callbacks;
    unsigned logged; /* a bit for each of `log_categories`, warnings first */
    Environment host;
    int went_well;
    char name[];
} Slave;

enum { WARNINGS = 1, EVERY_CATEGORY = ~0u >> 1 };

typedef enum {
    SET_DEBUG_LOGGING, SETUP_EXPERIMENT, ENTER, EXIT, TERMINATE, RESET, GET_REAL, GET_INTEGER, GET_BOOLEAN,
    GET_STRING, SET_REAL, SET_INTEGER, SET_BOOLEAN, SET_STRING, GET_STATE, SET_STATE, FREE_STATE, STATE_SIZE,
    SERIALIZE, DESERIALIZE, DERIVATIVE, SET_RATES, GET_RATES, DO_STEP, CANCEL_STEP, GET_STATUS,
} Call;

/* Return the slave if it can be called now, else NULL. */
Slave *called(fmi2Component component, Call call);

/* Log the instance's message and return the status. */
fmi2Status report(Slave *slave, fmi2Status status);

/* Log what printf would write as the reason, and return fmi2Error. */
fmi2Status refuse(Slave *slave, const char *format, ...);

/* Return fmi2OK if all is fine, else report an error. */
fmi2Status checked(Slave *slave, int fine);

/* `checked` of what computes, which it does in the environment that it is meant for. */
#define HELD(slave, computed)                                                                                          \
    ((slave)->host = hold(), (slave)->went_well = (computed), give_back((slave)->host), checked(slave, (slave)->went_well))

/* Whether a pointer is not NULL; reports an error if it is. */
int given(Slave *slave, Call call, const void *pointer, const char *argument);

#endif
