/* The steps of a co-simulation master, for FMUs of any make, loaded or linked: tables in, rows of outputs out.

   Nothing is allocated, and nothing kept between calls: who makes the tables owns the memory that they point to. The structures
   are laid out as in `in_c.py`. */
#ifndef LOOP_H
#define LOOP_H

#include <stddef.h>

#include "fmi2FunctionTypes.h"

#ifndef LOOP_LIBRARY
#define API
#elif defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

enum { REAL, INTEGER, BOOLEAN, STRING, TYPES }; /* an Enumeration is an INTEGER, by the standard's functions */
enum { JACOBI, GAUSS_SEIDEL };
enum { TEXT_SIZE = 64 }; /* bytes of a String in a row; the rest of a longer one is left out */

/* Some variables of one type of one FMU: the memory through which they are read or set. */
typedef struct {
    size_t n, n_recorded;
    const size_t *recorded; /* of outputs, the places of those that make a row */
    const fmi2ValueReference *references;
    void *values; /* double, int, int, or const char * */
} Block;

typedef struct {
    fmi2Component component;
    fmi2DoStepTYPE *do_step;
    fmi2GetRealTYPE *get_real;
    fmi2GetIntegerTYPE *get_integer;
    fmi2GetBooleanTYPE *get_boolean;
    fmi2GetStringTYPE *get_string;
    fmi2SetRealTYPE *set_real;
    fmi2SetIntegerTYPE *set_integer;
    fmi2SetBooleanTYPE *set_boolean;
    Block outputs[TYPES], inputs[TYPES]; /* all outputs, the inputs that are fed; there is no input of STRING */
    size_t parts, every; /* it takes so many equal steps in a step of the loop, or one in every so many: one of them is 1 */
} Slave;

/* Outputs of one FMU that become inputs of another, of one type: target[to[i]] = factors[i] * source[from[i]]. */
typedef struct {
    size_t sender, receiver, type, n;
    const size_t *from, *to;
    const double *factors; /* of Reals; there are none for other types */
} Copy;

/* An input that is fed from outside: from its column of `Loop.given`. */
typedef struct {
    size_t receiver, type, to;
} Feed;

typedef struct {
    size_t n_slaves, n_copies, n_feeds, coupling;
    const Slave *slaves;
    const Copy *copies;
    const Feed *feeds;
    double start_time, step;
    int must_be_finite; /* whether a Real that is not ends the run */
} Loop;

/* Where the loop is, for whoever watches it, and its word to stop. `call` is 'g', 's', 'd' for get, set, doStep of the slave; of 'n'
   the value number `variable` of its outputs, of 'f' of its inputs, is not finite; 0 when no call is under way.
   Of doStep `variable` is the number of the part. */
typedef struct {
    size_t step, recorded, slave, type, variable; /* `step` is the number of the step that is being taken, `recorded` that of rows */
    int call, status, stop;
} Watch;

/* `given` has a row a step, of a number for each feed; it may be NULL where there are no feeds. */

/* Hand the initial values on until no output changes, at most so many times; `rows` is room for two rows of all outputs, each of
   `size` bytes. Return 1 when they have settled, 0 when they do not, -1 when a call failed. */
API int settle(const Loop *loop, size_t passes, const double *given, size_t size, char *rows, volatile Watch *watch);

/* Read all outputs and record the first row. Return whether that went well. */
API int begin(const Loop *loop, char *row, volatile Watch *watch);

/* Take `count` steps from the step `first` on. The outputs to record make a row after the first step at or beyond each multiple
   of `spacing` steps. Return how many went well; if that is less, the watch has the call that failed, or none when it was told to
   stop. */
API size_t run(const Loop *loop, size_t first, size_t count, const double *given, double spacing, char *rows, volatile Watch *watch);

#endif
