/* FMI 3.0: the life of an instance, its log and its steps. */
#include <math.h>

#include "fmi3Functions.h"
#include "slave.h"

/* More than the standard asks for: values can be read at any time. */
const Rule calls[] = {
    [SET_DEBUG_LOGGING] = {"fmi3SetDebugLogging",          ANY},
    [ENTER]             = {"fmi3EnterInitializationMode",  I},
    [EXIT]              = {"fmi3ExitInitializationMode",   M},
    [TERMINATE]         = {"fmi3Terminate",                R | T},
    [RESET]             = {"fmi3Reset",                    ANY},
    [GET_REAL]          = {"fmi3GetFloat64",               ANY},
    [GET_INTEGER]       = {"fmi3GetInt32",                 ANY},
    [GET_BOOLEAN]       = {"fmi3GetBoolean",               ANY},
    [SET_REAL]          = {"fmi3SetFloat64",               I | M | R},
    [SET_INTEGER]       = {"fmi3SetInt32",                 I | M | R},
    [SET_BOOLEAN]       = {"fmi3SetBoolean",               I | M | R},
    [GET_STATE]         = {"fmi3GetFMUState",              ANY},
    [SET_STATE]         = {"fmi3SetFMUState",              ANY},
    [FREE_STATE]        = {"fmi3FreeFMUState",             ANY},
    [STATE_SIZE]        = {"fmi3SerializedFMUStateSize",   ANY},
    [SERIALIZE]         = {"fmi3SerializeFMUState",        ANY},
    [DESERIALIZE]       = {"fmi3DeserializeFMUState",      ANY},
    [DERIVATIVE]        = {"fmi3GetDirectionalDerivative", M | R},
    [ADJOINT]           = {"fmi3GetAdjointDerivative",     M | R},
    [DO_STEP]           = {"fmi3DoStep",                   R},
};

void tell(const Slave *slave, int status, const char *category) {
    fmi3LogMessageCallback logger = (fmi3LogMessageCallback)slave->logger;
    logger(slave->environment, (fmi3Status)status, category, slave->instance.message);
}

const char *fmi3GetVersion(void) {
    return fmi3Version;
}

static Slave *begun(const char *name, int logging_on, void *environment, fmi3LogMessageCallback logger) {
    Slave *slave = new_slave(name, logging_on);
    if (slave) {
        slave->environment = environment;
        slave->logger = (void (*)(void))logger;
    }
    return slave;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t n_intermediate,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback update) {
    Slave *slave = begun(name, logging_on, environment, logger);
    (void)visible, (void)early_return, (void)intermediate, (void)update;
    if (!slave)
        return NULL;
    if (event_mode)
        say(slave->instance.message, "There is no Event Mode (hasEventMode is false).");
    else if (n_intermediate)
        say(slave->instance.message, "There are no values between steps (providesIntermediateUpdate is false).");
    return admitted(slave, "instantiation token", token, resources);
}

static fmi3Instance not_of_this_type(const char *name, void *environment, fmi3LogMessageCallback logger,
                                     const char *type) {
    Slave *slave = begun(name, 0, environment, logger);
    if (slave)
        refuse(slave, "The FMU type is %s; expected Co-Simulation.", type);
    free_slave(slave);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger) {
    (void)token, (void)resources, (void)visible, (void)logging_on;
    return not_of_this_type(name, environment, logger, "Model Exchange");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging_on,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    (void)token, (void)resources, (void)visible, (void)logging_on, (void)update, (void)lock, (void)unlock;
    return not_of_this_type(name, environment, logger, "Scheduled Execution");
}

void fmi3FreeInstance(fmi3Instance c) {
    free_slave(c);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    Slave *slave = called(c, SET_DEBUG_LOGGING);
    return slave ? choose_categories(slave, on, n, categories) : fmi3Error;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start_time, fmi3Boolean stop_time_defined, fmi3Float64 stop_time) {
    Slave *slave = called(c, ENTER);
    (void)tolerance_defined, (void)tolerance;
    if (!slave)
        return fmi3Error;
    if (HELD(slave, set_times(&slave->instance, start_time, stop_time_defined ? stop_time : INFINITY)) != fmi3OK)
        return fmi3Error;
    slave->instance.now.phase = INITIALIZING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Slave *slave = called(c, EXIT);
    return slave ? HELD(slave, exit_initialization(&slave->instance)) : fmi3Error;
}

fmi3Status fmi3Terminate(fmi3Instance c) {
    Slave *slave = called(c, TERMINATE);
    if (!slave)
        return fmi3Error;
    slave->instance.now.phase = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c) {
    Slave *slave = called(c, RESET);
    if (!slave)
        return fmi3Error;
    reset(&slave->instance);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state_before,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last_time) {
    Slave *slave = called(c, DO_STEP);
    (void)no_set_state_before;
    if (!slave || !given(slave, DO_STEP, event, "eventHandlingNeeded")
        || !given(slave, DO_STEP, terminate, "terminateSimulation")
        || !given(slave, DO_STEP, early_return, "earlyReturn")
        || !given(slave, DO_STEP, last_time, "lastSuccessfulTime"))
        return fmi3Error;
    fmi3Status status = HELD(slave, do_step(&slave->instance, time, step));
    *event = *terminate = *early_return = fmi3False;
    (void)HELD(slave, host_time(&slave->instance, last_time));
    return status;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    return get_state(c, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    return set_state(c, state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    return free_state(c, state);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    return state_size(c, state, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    return serialize(c, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    return deserialize(c, bytes, size, state);
}
