/* The steps of the master: what `exchange.py` does, over the same memory, for FMUs of any make.

   Structures are laid out as in `native.py`. */
#include <stddef.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { REAL, INTEGER, BOOLEAN, TYPES };
enum { JACOBI, GAUSS_SEIDEL };

/* Some variables of one type of one FMU: the memory through which they are read or set. */
typedef struct {
    size_t n;
    const fmi2ValueReference *references;
    void *values;
} Block;

typedef struct {
    fmi2Component component;
    fmi2DoStepTYPE *do_step;
    fmi2GetRealTYPE *get_real;
    fmi2GetIntegerTYPE *get_integer;
    fmi2GetBooleanTYPE *get_boolean;
    fmi2SetRealTYPE *set_real;
    fmi2SetIntegerTYPE *set_integer;
    fmi2SetBooleanTYPE *set_boolean;
    Block outputs[TYPES], inputs[TYPES];
} Slave;

/* Outputs of one FMU that become inputs of another, of one type: target[to[i]] = factors[i] * source[from[i]]. */
typedef struct {
    size_t receiver, type, n;
    const size_t *from, *to;
    const double *factors; /* of Reals; there are none for other types */
    const void *source;
    void *target;
} Copy;

typedef struct {
    size_t n_slaves, n_copies, coupling;
    const Slave *slaves;
    const Copy *copies; /* by receiver, in the order of the slaves */
    double start_time, step;
} Loop;

/* Which call failed: `call` is 'g', 's' or 'd' for get, set, doStep. */
typedef struct {
    size_t slave, step, type;
    int call, status;
} Failure;

static void hand_on(const Copy *copy) {
    for (size_t i = 0; i < copy->n; i++) {
        if (copy->type == REAL)
            ((double *)copy->target)[copy->to[i]] = copy->factors[i] * ((const double *)copy->source)[copy->from[i]];
        else
            ((int *)copy->target)[copy->to[i]] = ((const int *)copy->source)[copy->from[i]];
    }
}

static int get(const Slave *slave, int type) {
    const Block *b = &slave->outputs[type];
    if (type == REAL)
        return slave->get_real(slave->component, b->references, b->n, b->values);
    if (type == INTEGER)
        return slave->get_integer(slave->component, b->references, b->n, b->values);
    return slave->get_boolean(slave->component, b->references, b->n, b->values);
}

static int set(const Slave *slave, int type) {
    const Block *b = &slave->inputs[type];
    if (type == REAL)
        return slave->set_real(slave->component, b->references, b->n, b->values);
    if (type == INTEGER)
        return slave->set_integer(slave->component, b->references, b->n, b->values);
    return slave->set_boolean(slave->component, b->references, b->n, b->values);
}

/* Each of the following tells whether it went well. */

static int check(int status, int call, int type, Failure *failure) {
    if (status <= fmi2Warning)
        return 1;
    failure->status = status;
    failure->call = call;
    failure->type = (size_t)type;
    return 0;
}

static int feed(const Loop *loop, size_t receiver, Failure *failure) {
    for (size_t i = 0; i < loop->n_copies; i++)
        if (loop->copies[i].receiver == receiver)
            hand_on(&loop->copies[i]);
    for (int type = REAL; type < TYPES; type++)
        if (loop->slaves[receiver].inputs[type].n && !check(set(&loop->slaves[receiver], type), 's', type, failure))
            return 0;
    return 1;
}

static int advance(const Loop *loop, size_t slave, double time, Failure *failure) {
    const Slave *one = &loop->slaves[slave];
    return check(one->do_step(one->component, time, loop->step, fmi2True), 'd', 0, failure);
}

static int read(const Loop *loop, size_t slave, Failure *failure) {
    for (int type = REAL; type < TYPES; type++)
        if (loop->slaves[slave].outputs[type].n && !check(get(&loop->slaves[slave], type), 'g', type, failure))
            return 0;
    return 1;
}

static int take_step(const Loop *loop, double time, Failure *failure) {
    size_t n = loop->n_slaves, *i = &failure->slave;
    if (loop->coupling == GAUSS_SEIDEL) {
        for (*i = 0; *i < n; ++*i)
            if (!feed(loop, *i, failure) || !advance(loop, *i, time, failure) || !read(loop, *i, failure))
                return 0;
        return 1;
    }
    for (*i = 0; *i < n; ++*i)
        if (!feed(loop, *i, failure))
            return 0;
    for (*i = 0; *i < n; ++*i)
        if (!advance(loop, *i, time, failure))
            return 0;
    for (*i = 0; *i < n; ++*i)
        if (!read(loop, *i, failure))
            return 0;
    return 1;
}

static double *record(const Loop *loop, double *row) {
    for (size_t i = 0; i < loop->n_slaves; i++)
        for (int type = REAL; type < TYPES; type++) {
            const Block *b = &loop->slaves[i].outputs[type];
            for (size_t k = 0; k < b->n; k++)
                *row++ = type == REAL ? ((const double *)b->values)[k] : ((const int *)b->values)[k];
        }
    return row;
}

/* Take `count` steps from the step `first` on, and record the outputs after each, a row a step. Return how many went
   well; if that is less, `failure` tells why. */
EXPORT size_t run(const Loop *loop, size_t first, size_t count, double *rows, Failure *failure) {
    for (size_t n = 0; n < count; n++) {
        failure->step = first + n;
        if (!take_step(loop, loop->start_time + (double)(first + n) * loop->step, failure))
            return n;
        rows = record(loop, rows);
    }
    return count;
}
