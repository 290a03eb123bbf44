#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "slave.h"

enum { I = INSTANTIATED, M = INITIALIZING, R = RUNNING, T = TERMINATED, ANY = I | M | R | T | FAILED };

/* The phases in which each function can be called. More than the standard asks for: values can be read at any time. */
static const struct {
    const char *name;
    unsigned phases;
} calls[] = {
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

fmi2Status report(Slave *slave, fmi2Status status) {
    int category = status - fmi2Warning;
    char *percent = slave->instance.message;
    while ((percent = strpbrk(percent, "%#")))
        *percent = '?'; /* of a name from outside; to a logger they are a format and a reference */
    if (slave->logged >> category & 1u && slave->callbacks.logger)
        slave->callbacks.logger(slave->callbacks.componentEnvironment, slave->name, status, log_categories[category],
                                slave->instance.message);
    return status;
}

fmi2Status refuse(Slave *slave, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(slave->instance.message, MESSAGE_SIZE, format, arguments);
    va_end(arguments);
    return report(slave, fmi2Error);
}

fmi2Status checked(Slave *slave, int fine) {
    return fine ? fmi2OK : report(slave, fmi2Error);
}

Slave *called(fmi2Component component, Call call) {
    Slave *slave = component;
    if (!slave || slave->instance.now.phase & (int64_t)calls[call].phases)
        return slave;
    say(slave->instance.message, "%s can be called only while", calls[call].name);
    for (unsigned phase = INSTANTIATED, left = calls[call].phases; left; phase *= 2) {
        if (left & phase) {
            left &= ~phase;
            append(slave->instance.message, " %s%s", phase_name(phase), !left ? "" : left & (left - 1) ? "," : " or");
        }
    }
    append(slave->instance.message, "; the component is %s.", phase_name(slave->instance.now.phase));
    report(slave, fmi2Error);
    return NULL;
}

int given(Slave *slave, Call call, const void *pointer, const char *argument) {
    if (!pointer)
        refuse(slave, "%s: the argument %s is NULL.", calls[call].name, argument);
    return pointer != NULL;
}
