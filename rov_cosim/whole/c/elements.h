/* The elements of a system, each behind its functions of FMI, and the loop that steps them.

   What returns int returns whether it went well; if not, `failure` of the elements has why, with the name of the element. */
#ifndef ELEMENTS_H
#define ELEMENTS_H

#include <stddef.h>
#include <stdint.h>

#include "fmi2FunctionTypes.h"
#include "message.h"

typedef struct Elements Elements;

/* Is told of each warning of an element, which it names. */
typedef void Heed(void *receiver, const char *warning);

/* Instantiate all; `failure` is theirs too. Return NULL if there is no memory or one cannot be had. `values` has the variables of
   the system: outputs go there. */
Elements *new_elements(const char *resources, double *values, char *failure, Heed *heed, void *receiver);
void free_elements(Elements *elements);

/* The way to a run: renew, set all values, enter, leave. After `enter` and `leave` the outputs are those of the start. */
int renew(Elements *elements);
int enter(Elements *elements, double start_time, int coupling);
int are_entered(const Elements *elements, double start_time); /* and nothing else came since */
int leave(Elements *elements);
void abandon(Elements *elements); /* what they are no longer counts: they wait to be renewed */

/* Set a variable of the system that belongs to an element; `type` is its type in loop.h, and in interface.h. */
int hand_in(Elements *elements, uint32_t reference, int type, double value);

/* Take inner steps from the number `first` on. Return how many went well. */
size_t advance(Elements *elements, size_t first, size_t count, double start_time, int coupling);

size_t states_size(const Elements *elements);
int save_states(Elements *elements, char *bytes);
int are_states(Elements *elements, const char *bytes); /* saved by them and undamaged; keeps them for the next */
int restore_states(Elements *elements);

/* --- what is made of a system: its tables, and where the functions come from --- */

#define EACH_FUNCTION(X)                                                                                               \
    X(Instantiate) X(FreeInstance) X(SetupExperiment) X(EnterInitializationMode) X(ExitInitializationMode) X(Terminate) \
    X(Reset) X(GetReal) X(GetInteger) X(GetBoolean) X(SetReal) X(SetInteger) X(SetBoolean) X(DoStep) X(GetFMUstate)     \
    X(SetFMUstate) X(FreeFMUstate) X(SerializedFMUstateSize) X(SerializeFMUstate) X(DeSerializeFMUstate)

#define MEMBER(name) fmi2##name##TYPE *name;
typedef struct {
    EACH_FUNCTION(MEMBER)
} Functions;
#undef MEMBER

typedef struct {
    const char *name, *guid;
    const char *library, *folder; /* name of the binary, and of the folder as in a URL; of an element that is loaded */
    size_t outputs[4], inputs[4]; /* how many of each type: all outputs, the connected inputs */
    size_t parts, every;          /* as in loop.h */
} Element;

extern const Element elements_table[];
extern const uint32_t first_output;               /* of the system; the outputs of the elements follow, by element and type */
extern const uint32_t owners[];                   /* the element of each variable of the system */
extern const fmi2ValueReference references[];     /* what the variable is in its element */
extern const fmi2ValueReference fed_references[]; /* of the connected inputs, by element and type */
extern const double inner_step;
const char *name_of(uint32_t reference); /* of a variable of the system */

/* Where the functions are: in this binary, or in another. `open_element` returns NULL, and why, if there are none. */
extern const int are_linked;
const Functions *open_element(size_t element, const char *resources, Message failure);
void close_element(const Functions *functions);
void location_of(size_t element, const char *resources, char *location, size_t size);

#endif
