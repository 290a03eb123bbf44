/* FMI 2.0: the life of an instance, its log and its steps. */
#include <math.h>

#include "fmi2Functions.h"
#include "slave.h"

/* More than the standard asks for: values can be read at any time. */
const Rule calls[] = {
    [SET_DEBUG_LOGGING] = {"fmi2SetDebugLogging",          ANY},
    [SETUP_EXPERIMENT]  = {"fmi2SetupExperiment",          I},
    [ENTER]             = {"fmi2EnterInitializationMode",  I},
    [EXIT]              = {"fmi2ExitInitializationMode",   M},
    [TERMINATE]         = {"fmi2Terminate",                R | T},
    [RESET]             = {"fmi2Reset",                    ANY},
    [GET_REAL]          = {"fmi2GetReal",                  ANY},
    [GET_INTEGER]       = {"fmi2GetInteger",               ANY},
    [GET_BOOLEAN]       = {"fmi2GetBoolean",               ANY},
    [GET_STRING]        = {"fmi2GetString",                ANY},
    [SET_REAL]          = {"fmi2SetReal",                  I | M | R},
    [SET_INTEGER]       = {"fmi2SetInteger",               I | M | R},
    [SET_BOOLEAN]       = {"fmi2SetBoolean",               I | M | R},
    [SET_STRING]        = {"fmi2SetString",                I | M | R},
    [GET_STATE]         = {"fmi2GetFMUstate",              ANY},
    [SET_STATE]         = {"fmi2SetFMUstate",              ANY},
    [FREE_STATE]        = {"fmi2FreeFMUstate",             ANY},
    [STATE_SIZE]        = {"fmi2SerializedFMUstateSize",   ANY},
    [SERIALIZE]         = {"fmi2SerializeFMUstate",        ANY},
    [DESERIALIZE]       = {"fmi2DeSerializeFMUstate",      ANY},
    [DERIVATIVE]        = {"fmi2GetDirectionalDerivative", M | R},
    [SET_RATES]         = {"fmi2SetRealInputDerivatives",  M | R},
    [GET_RATES]         = {"fmi2GetRealOutputDerivatives", M | R},
    [DO_STEP]           = {"fmi2DoStep",                   R},
    [CANCEL_STEP]       = {"fmi2CancelStep",               R},
    [GET_STATUS]        = {"fmi2GetStatus",                R | T},
};

void tell(const Slave *slave, int status, const char *category) {
    fmi2CallbackLogger logger = (fmi2CallbackLogger)slave->logger;
    logger(slave->environment, slave->name, (fmi2Status)status, category, slave->instance.message);
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
    Slave *slave = functions ? new_slave(name, logging_on) : NULL;
    if (!slave)
        return NULL;
    slave->environment = functions->componentEnvironment;
    slave->logger = (void (*)(void))functions->logger;
    if (type != fmi2CoSimulation)
        say(slave->instance.message, "The FMU type is %d; expected fmi2CoSimulation (%d).", (int)type,
            (int)fmi2CoSimulation);
    return admitted(slave, "GUID", given_guid, resources);
}

void fmi2FreeInstance(fmi2Component c) {
    free_slave(c);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    Slave *slave = called(c, SET_DEBUG_LOGGING);
    return slave ? choose_categories(slave, on, n, categories) : fmi2Error;
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
    return HELD(slave, host_time(&slave->instance, value));
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
