#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "elements.h"
#include "links.h"
#include "loop.h"

/* Which element logs what. */
typedef struct {
    Elements *elements;
    size_t element;
} Voice;

struct Elements {
    const Functions *functions[N_ELEMENTS];
    fmi2CallbackFunctions callbacks[N_ELEMENTS];
    Voice voices[N_ELEMENTS];
    fmi2FMUstate states[N_ELEMENTS]; /* room for theirs */
    size_t state_sizes[N_ELEMENTS];
    Slave slaves[N_ELEMENTS];
    Loop loop;
    enum { FRESH, USED, ENTERED, LEFT } stage;
    double *values, fed_reals[N_FED_REALS + 1];
    int whole_outputs[N_WHOLE_OUTPUTS + 1], fed_wholes[N_FED_WHOLES + 1];
    char rows[2 * ROW_SIZE];
    Message said; /* why the call under way fails, by its element */
    char *failure;
    Heed *heed;
    void *receiver;
};

/* --- logs and failures --- */

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String format, ...) {
    Voice *voice = environment;
    Message text, named;
    va_list arguments;
    (void)name, (void)category;
    if (!voice)
        return; /* an FMU that does not give back what it was given: whose it is cannot be told */
    Elements *e = voice->elements;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format ? format : "", arguments);
    va_end(arguments);
    if (status == fmi2Warning) {
        say(named, "%s: %s", elements_table[voice->element].name, text);
        e->heed(e->receiver, named);
    } else if (status > fmi2Warning && text[0]) {
        append(e->said, "%s%s", e->said[0] ? " " : "", text);
    }
}

/* Say what an element said, or else which of its functions failed. */
static void blame(Elements *e, size_t element, const char *function, int status) {
    if (e->said[0])
        say(e->failure, "%s: %s", elements_table[element].name, e->said);
    else
        say(e->failure, "%s: %s returned status %d.", elements_table[element].name, function, status);
}

static int fine(Elements *e, size_t element, const char *function, fmi2Status status) {
    if (status > fmi2Warning)
        blame(e, element, function, status);
    e->said[0] = 0;
    return status <= fmi2Warning;
}

#define CALL(e, i, name, ...) fine(e, i, "fmi2" #name, (e)->functions[i]->name((e)->slaves[i].component, __VA_ARGS__))
#define CALL_BARE(e, i, name) fine(e, i, "fmi2" #name, (e)->functions[i]->name((e)->slaves[i].component))

/* Say which call of the loop failed, or which value is not finite. */
static void blame_in_loop(Elements *e, const Watch *watch) {
    static const char *const by_type[] = {"Real", "Integer", "Boolean", "String"};
    const char *element = elements_table[watch->slave].name;
    char function[32], time[NUMBER_SIZE];
    number(e->loop.start_time + (double)watch->step * e->loop.step, 9, time);
    if (watch->call == 'n') {
        size_t first = first_output;
        while (owners[first] != watch->slave)
            first++;
        say(e->failure, "%s is not finite after the step from %s s.", name_of((uint32_t)(first + watch->variable)), time);
    } else if (watch->call == 'f') {
        say(e->failure, "%s: the value of a connected input is not finite in the step from %s s.", element, time);
    } else {
        snprintf(function, sizeof function, "fmi2%s%s", watch->call == 'd' ? "DoStep" : watch->call == 'g' ? "Get" : "Set",
                 watch->call == 'd' ? "" : by_type[watch->type]);
        blame(e, watch->slave, function, watch->status);
    }
    e->said[0] = 0;
}

/* --- making --- */

static Block block(size_t n, const fmi2ValueReference *vr, void *values) {
    Block made = {n, 0, NULL, vr, values};
    return made;
}

/* Lay out the memory through which the loop reads outputs and feeds inputs. */
static void lay_out(Elements *e) {
    size_t at = first_output, wholes = 0, fed = 0, fed_reals = 0, fed_wholes = 0;
    for (size_t i = 0; i < N_ELEMENTS; i++) {
        const Element *element = &elements_table[i];
        for (int type = REAL; type < STRING; type++) {
            size_t n = element->outputs[type], fed_n = element->inputs[type];
            int is_real = type == REAL;
            e->slaves[i].outputs[type] =
                block(n, &references[at], is_real ? (void *)&e->values[at] : (void *)&e->whole_outputs[wholes]);
            e->slaves[i].inputs[type] = block(fed_n, &fed_references[fed],
                                              is_real ? (void *)&e->fed_reals[fed_reals] : (void *)&e->fed_wholes[fed_wholes]);
            at += n;
            fed += fed_n;
            wholes += is_real ? 0 : n;
            fed_reals += is_real ? fed_n : 0;
            fed_wholes += is_real ? 0 : fed_n;
        }
    }
}

static int make(Elements *e, size_t i, const char *resources) {
    const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, &e->voices[i]};
    const Functions *f = e->functions[i] = open_element(i, resources, e->failure);
    char location[4096];
    if (!f)
        return 0;
    e->voices[i] = (Voice){e, i};
    memcpy(&e->callbacks[i], &callbacks, sizeof callbacks);
    location_of(i, resources, location, sizeof location);
    Slave slave = {f->Instantiate(elements_table[i].name, fmi2CoSimulation, elements_table[i].guid, location, &e->callbacks[i],
                                  fmi2False, fmi2True),
                   f->DoStep, f->GetReal, f->GetInteger, f->GetBoolean, NULL, f->SetReal, f->SetInteger, f->SetBoolean,
                   {{0}}, {{0}}, elements_table[i].parts, elements_table[i].every};
    e->slaves[i] = slave;
    if (!fine(e, i, "fmi2Instantiate", slave.component ? fmi2OK : fmi2Error))
        return 0;
    return !are_linked
        || (CALL(e, i, GetFMUstate, &e->states[i]) && CALL(e, i, SerializedFMUstateSize, e->states[i], &e->state_sizes[i]));
}

Elements *new_elements(const char *resources, double *values, char *failure, Heed *heed, void *receiver) {
    Elements *e = calloc(1, sizeof *e);
    if (!e) {
        say(failure, "There is no memory for the elements.");
        return NULL;
    }
    e->values = values;
    e->failure = failure;
    e->heed = heed;
    e->receiver = receiver;
    for (size_t i = 0; i < N_ELEMENTS; i++) {
        if (!make(e, i, resources)) {
            free_elements(e);
            return NULL;
        }
    }
    Loop loop = {N_ELEMENTS, N_COPIES, 0, JACOBI, e->slaves, copies, NULL, 0, inner_step, 1};
    e->loop = loop;
    lay_out(e);
    return e;
}

void free_elements(Elements *e) {
    for (size_t i = 0; e && i < N_ELEMENTS; i++) {
        fmi2Component component = e->slaves[i].component;
        if (component && e->stage == LEFT)
            e->functions[i]->Terminate(component);
        if (component && e->states[i])
            e->functions[i]->FreeFMUstate(component, &e->states[i]);
        if (component)
            e->functions[i]->FreeInstance(component);
        if (e->functions[i])
            close_element(e->functions[i]);
    }
    free(e);
}

/* --- running --- */

/* Outputs that are no Reals have memory of their own: give them to the system, or take them back. */

static void publish(Elements *e) {
    for (size_t i = 0; i < N_WHOLE_OUTPUTS; i++)
        e->values[whole_references[i]] = e->whole_outputs[i];
}

static void take_back(Elements *e) {
    for (size_t i = 0; i < N_WHOLE_OUTPUTS; i++)
        e->whole_outputs[i] = (int)e->values[whole_references[i]];
}

static int read_all(Elements *e) {
    Watch watch = {0};
    int well = begin(&e->loop, e->rows, &watch);
    if (!well)
        blame_in_loop(e, &watch);
    publish(e);
    return well;
}

void abandon(Elements *e) {
    e->stage = e->stage == FRESH ? FRESH : USED;
}

int renew(Elements *e) {
    for (size_t i = 0; i < N_ELEMENTS && e->stage != FRESH; i++)
        if (!CALL_BARE(e, i, Reset))
            return 0;
    e->stage = USED;
    return 1;
}

int hand_in(Elements *e, uint32_t reference, int type, double value) {
    size_t i = owners[reference];
    const fmi2ValueReference *vr = &references[reference];
    if (type == REAL)
        return CALL(e, i, SetReal, vr, 1, &value);
    fmi2Integer whole = (fmi2Integer)value;
    if (type == INTEGER)
        return CALL(e, i, SetInteger, vr, 1, &whole);
    return CALL(e, i, SetBoolean, vr, 1, &whole);
}

int enter(Elements *e, double start_time, int coupling) {
    Watch watch = {0};
    e->loop.start_time = start_time;
    e->loop.coupling = (size_t)coupling;
    for (size_t i = 0; i < N_ELEMENTS; i++)
        if (!CALL(e, i, SetupExperiment, fmi2False, 0, start_time, fmi2False, 0) || !CALL_BARE(e, i, EnterInitializationMode))
            return 0;
    int settled = settle(&e->loop, MOST_PASSES, NULL, ROW_SIZE, e->rows, &watch);
    if (settled < 0)
        blame_in_loop(e, &watch);
    else if (!settled)
        say(e->failure, "The initial values do not settle: they depend on each other in a loop.");
    if (settled <= 0)
        return 0;
    publish(e);
    e->stage = ENTERED;
    return 1;
}

int are_entered(const Elements *e, double start_time) {
    return e->stage == ENTERED && e->loop.start_time == start_time;
}

int leave(Elements *e) {
    e->stage = USED;
    for (size_t i = 0; i < N_ELEMENTS; i++)
        if (!CALL_BARE(e, i, ExitInitializationMode))
            return 0;
    e->stage = LEFT;
    return read_all(e);
}

size_t advance(Elements *e, size_t first, size_t count, double start_time, int coupling) {
    Watch watch = {0};
    e->loop.start_time = start_time;
    e->loop.coupling = (size_t)coupling;
    size_t done = run(&e->loop, first, count, NULL, INFINITY, e->rows, &watch);
    if (done < count)
        blame_in_loop(e, &watch);
    publish(e);
    return done;
}

/* --- saving --- */

size_t states_size(const Elements *e) {
    size_t sum = 0;
    for (size_t i = 0; i < N_ELEMENTS; i++)
        sum += e->state_sizes[i];
    return sum;
}

static int are_savable(Elements *e) {
    if (!are_linked)
        say(e->failure, "The elements of this system are FMUs of their own, which it cannot save (canGetAndSetFMUstate is false).");
    return are_linked;
}

int save_states(Elements *e, char *bytes) {
    if (!are_savable(e))
        return 0;
    for (size_t i = 0; i < N_ELEMENTS; bytes += e->state_sizes[i++])
        if (!CALL(e, i, GetFMUstate, &e->states[i]) || !CALL(e, i, SerializeFMUstate, e->states[i], bytes, e->state_sizes[i]))
            return 0;
    return 1;
}

int are_states(Elements *e, const char *bytes) {
    if (!are_savable(e))
        return 0;
    for (size_t i = 0; i < N_ELEMENTS; bytes += e->state_sizes[i++])
        if (!CALL(e, i, DeSerializeFMUstate, bytes, e->state_sizes[i], &e->states[i]))
            return 0;
    return 1;
}

int restore_states(Elements *e) {
    for (size_t i = 0; i < N_ELEMENTS; i++)
        if (!CALL(e, i, SetFMUstate, e->states[i]))
            return 0;
    take_back(e);
    e->stage = LEFT;
    return 1;
}
