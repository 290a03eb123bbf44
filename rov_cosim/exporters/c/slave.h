/* An instance behind FMI, of either version: who may call when, what is NULL, what is logged. */
#ifndef SLAVE_H
#define SLAVE_H

#include "instance.h"

typedef struct {
    Instance instance;
    void *environment;    /* the host's, for its logger */
    void (*logger)(void); /* of the type that the version of FMI has; NULL if there is none */
    unsigned logged;      /* a bit for each of `log_categories`, warnings first */
    Environment host;     /* see HELD */
    int went_well;
    char name[];
} Slave;

/* As both versions number them. The functions of each return them as its own type. */
enum { OK, WARNING, DISCARD, REFUSED };

enum { WARNINGS = 1, EVERY_CATEGORY = ~0u >> 1 };

typedef enum {
    SET_DEBUG_LOGGING, SETUP_EXPERIMENT, ENTER, EXIT, TERMINATE, RESET, GET_REAL, GET_INTEGER, GET_BOOLEAN,
    GET_STRING, SET_REAL, SET_INTEGER, SET_BOOLEAN, SET_STRING, GET_STATE, SET_STATE, FREE_STATE, STATE_SIZE,
    SERIALIZE, DESERIALIZE, DERIVATIVE, ADJOINT, SET_RATES, GET_RATES, DO_STEP, CANCEL_STEP, GET_STATUS,
} Call;

/* --- what each version has of its own --- */

/* The name of each function, and the phases in which it can be called. */
typedef struct {
    const char *name;
    unsigned phases;
} Rule;

extern const Rule calls[];

enum { I = INSTANTIATED, M = INITIALIZING, R = RUNNING, T = TERMINATED, ANY = I | M | R | T | FAILED };

/* Hand the instance's message to the logger. */
void tell(const Slave *slave, int status, const char *category);

/* --- what they share --- */

/* Return a slave that is not yet `admitted`, or NULL if there is no memory. */
Slave *new_slave(const char *name, int logging_on);

/* Return the slave ready to be called, or NULL if its message tells why not; `token` is what the version calls the guid. */
Slave *admitted(Slave *slave, const char *token, const char *given_guid, const char *resources);

void free_slave(Slave *slave);

int choose_categories(Slave *slave, int on, size_t n, const char *const categories[]);

/* Return the slave if it can be called now, else NULL. */
Slave *called(void *component, Call call);

/* Log the instance's message and return the status. */
int report(Slave *slave, int status);

/* Log what printf would write as the reason, and return REFUSED. */
int refuse(Slave *slave, const char *format, ...);

/* Return OK if all is fine, else report that it is refused. */
int checked(Slave *slave, int fine);

/* `checked` of what computes, which it does in the environment that it is meant for. */
#define HELD(slave, computed)                                                                                          \
    ((slave)->host = hold(), (slave)->went_well = (computed), give_back((slave)->host), checked(slave, (slave)->went_well))

/* Whether a pointer is not NULL; reports it if it is. */
int given(Slave *slave, Call call, const void *pointer, const char *argument);

/* Save and restore; `component` is the slave, or NULL. */
int get_state(void *component, void **state);
int set_state(void *component, const void *state);
int free_state(void *component, void **state);
int state_size(void *component, const void *state, size_t *size);
int serialize(void *component, const void *state, void *bytes, size_t size);
int deserialize(void *component, const void *bytes, size_t size, void **state);

/* Derivatives, by element. Those that return int return whether it went well, and report it if not. */
int is_unknown(Slave *slave, uint32_t reference);
int is_known(Slave *slave, uint32_t reference);
int add_change(Slave *slave, uint32_t reference, double change, double *sum);
int has_derivative(Slave *slave, uint32_t reference, double derivative); /* whether it is finite */

#endif
