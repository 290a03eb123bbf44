/* What is generated for a component: component.h holds its sizes, component.c its tables, model.c its traced equations. */
#ifndef INTERFACE_H
#define INTERFACE_H

#include "component.h"
#include "hidden.h"

typedef enum { REAL, INTEGER, BOOLEAN, STRING } Type;

/* A variable; its value reference is its place in `variables`, which holds inputs, outputs and parameters, in this order. */
typedef struct {
    const char *name;
    Type type;
    int fixed; /* whether it cannot be set during a run */
    double start, minimum, maximum; /* where there is no limit, -DBL_MAX or DBL_MAX, so that what is in range is finite */
} Variable;

/* A warning, logged each time the output comes to equal the value. */
typedef struct {
    int output;
    double value;
    const char *message;
} Notice;

extern const char guid[];
extern const unsigned char fingerprint[16]; /* of a saved state: version of its form, component and names */
extern const Variable variables[N_VARIABLES];
extern const char *const states[];       /* names */
extern const char *const requirements[]; /* message of each margin that must be positive; ends with NULL */
extern const Notice notices[];           /* ends with a message of NULL */
extern const char *const log_categories[]; /* those of fmi2Warning, fmi2Discard, fmi2Error; ends with NULL */

/* The equations as CasADi writes them: arguments, results, none of them NULL, and what its expressions of scalars have no
   use for. */
typedef int Traced(const double **arguments, double **results, int *, double *, int);

Traced model_initial_state; /* p -> x */
Traced model_margins;       /* p -> one for each of `requirements` */
Traced model_constants;     /* p -> what the next three need of it and nothing else */
Traced model_advance;       /* continuous: x, u, p, h, constants -> x after an internal step of h */
Traced model_outputs;       /* continuous: x, u, p, constants -> y */
Traced model_sample;        /* sampled: x, u, p, draws, constants -> x after a sample, y */
Traced model_derivative;    /* x, u, p, draws (if sampled), direction of u -> directional derivative of y */

#endif
