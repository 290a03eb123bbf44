/* FMI 2.0: the life of an instance, its log and its steps. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

static void warn(void *slave, const char *message) {
    (void)message; /* it is the instance's */
    report(slave, fmi2Warning);
}

const char *fmi2GetTypesPlatform(void) {
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void) {
    return fmi2Version;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String given_guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on) {
    (void)visible;
    const char *known_name = name && *name ? name : "(without a name)";
    Slave *slave = functions ? calloc(1, sizeof *slave + strlen(known_name) + 1) : NULL;
    if (!slave)
        return NULL;
    strcpy(slave->name, known_name);
    slave->callbacks = *functions;
    slave->logged = logging_on ? EVERY_CATEGORY : EVERY_CATEGORY & ~WARNINGS; /* why a call failed is always told */
    slave->instance.warn = warn;
    slave->instance.receiver = slave;
    slave->instance.message[0] = 0;
    if (known_name != name)
        say(slave->instance.message, "The name of the instance is empty.");
    else if (type != fmi2CoSimulation)
        say(slave->instance.message, "The FMU type is %d; expected fmi2CoSimulation (%d).", (int)type,
            (int)fmi2CoSimulation);
    else if (!given_guid || strcmp(given_guid, guid))
        say(slave->instance.message, "The GUID is %.200s; expected %s: the model description is of another FMU.",
            given_guid ? given_guid : "NULL", guid);
    else
        take_parts(&slave->instance, resources);
    if (slave->instance.message[0]) {
        report(slave, fmi2Error);
        fmi2FreeInstance(slave);
        return NULL;
    }
    reset(&slave->instance);
    return slave;
}

void fmi2FreeInstance(fmi2Component c) {
    if (c)
        drop_parts(&((Slave *)c)->instance);
    free(c);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    Slave *slave = called(c, SET_DEBUG_LOGGING);
    unsigned chosen = n ? 0 : EVERY_CATEGORY;
    if (!slave || (n && !given(slave, SET_DEBUG_LOGGING, categories, "categories")))
        return fmi2Error;
    for (size_t i = 0; i < n; i++) {
        int known = 0;
        for (int k = 0; log_categories[k] && categories[i]; k++) {
            if (!strcmp(categories[i], log_categories[k])) {
                chosen |= 1u << k;
                known = 1;
            }
        }
        if (!known) {
            say(slave->instance.message, "There is no log category %.200s; expected one of",
                categories[i] ? categories[i] : "NULL");
            for (int k = 0; log_categories[k]; k++)
                append(slave->instance.message, "%s %s", k ? "," : "", log_categories[k]);
            append(slave->instance.message, ".");
            return report(slave, fmi2Error);
        }
    }
    slave->logged = on ? chosen : 0;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean stop_time_defined, fmi2Real stop_time) {
    Slave *slave = called(c, SETUP_EXPERIMENT);
    double stop = stop_time_defined ? stop_time : INFINITY;
    (void)tolerance_defined, (void)tolerance;
    return slave ? HELD(slave, set_times(&slave->instance, start_time, stop)) : fmi2Error;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Slave *slave = called(c, ENTER);
    if (!slave)
        return fmi2Error;
    slave->instance.now.phase = INITIALIZING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Slave *slave = called(c, EXIT);
    return slave ? HELD(slave, exit_initialization(&slave->instance)) : fmi2Error;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    Slave *slave = called(c, TERMINATE);
    if (!slave)
        return fmi2Error;
    slave->instance.now.phase = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    Slave *slave = called(c, RESET);
    if (!slave)
        return fmi2Error;
    reset(&slave->instance);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_set_state_before) {
    Slave *slave = called(c, DO_STEP);
    (void)no_set_state_before;
    /* Not fmi2Discard for a step that ends in illegal values: FMPy would repeat it for ever. */
    return slave ? HELD(slave, do_step(&slave->instance, time, step)) : fmi2Error;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    Slave *slave = called(c, CANCEL_STEP);
    return slave ? refuse(slave, "There is no step to cancel: fmi2DoStep returns when it is done.") : fmi2Error;
}

static fmi2Status no_status(fmi2Component c) {
    Slave *slave = called(c, GET_STATUS);
    if (slave)
        say(slave->instance.message, "There is no such status: fmi2DoStep returns when it is done.");
    return slave ? report(slave, fmi2Discard) : fmi2Error;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    return no_status(c);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    Slave *slave = called(c, GET_STATUS);
    if (slave && kind != fmi2LastSuccessfulTime)
        return no_status(c);
    if (!slave || !given(slave, GET_STATUS, value, "value"))
        return fmi2Error;
    *value = slave->instance.now.time + slave->instance.now.skew;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind, (void)value;
    return no_status(c);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    Slave *slave = called(c, GET_STATUS);
    if (slave && kind != fmi2Terminated)
        return no_status(c);
    if (!slave || !given(slave, GET_STATUS, value, "value"))
        return fmi2Error;
    *value = fmi2False; /* no component ends a run by itself */
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind, (void)value;
    return no_status(c);
}
