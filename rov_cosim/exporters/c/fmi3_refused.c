/* FMI 3.0: what these FMUs have not, answered with a reason. */
#include "fmi3Functions.h"
#include "fmi3_arrays.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

static fmi3Status refused(Slave *slave, const char *function, const char *reason) {
    return slave ? refuse(slave, "%s: %s.", function, reason) : fmi3Error;
}

#define REFUSED(function, reason, ...)                                                                                 \
    fmi3Status function(fmi3Instance c, __VA_ARGS__) {                                                                 \
        return refused(c, #function, reason);                                                                          \
    }
#define REFUSED_ALWAYS(function, reason)                                                                               \
    fmi3Status function(fmi3Instance c) {                                                                              \
        return refused(c, #function, reason);                                                                          \
    }

#define REFERENCES const fmi3ValueReference vr[], size_t n

/* --- types of which there is no variable --- */

static fmi3Status absent(Slave *slave, const char *type, REFERENCES) {
    if (!slave)
        return fmi3Error;
    if (n && !vr)
        return refuse(slave, "The argument valueReferences is NULL.");
    return n ? refuse_reference(slave, vr[0], type), fmi3Error : fmi3OK;
}

#define ABSENT(type)                                                                                                   \
    fmi3Status fmi3Get##type(fmi3Instance c, REFERENCES, fmi3##type values[], size_t n_values) {                       \
        return absent(c, #type, vr, n);                                                                                \
    }                                                                                                                  \
    fmi3Status fmi3Set##type(fmi3Instance c, REFERENCES, const fmi3##type values[], size_t n_values) {                 \
        return absent(c, #type, vr, n);                                                                                \
    }

ABSENT(Float32)
ABSENT(Int8)
ABSENT(UInt8)
ABSENT(Int16)
ABSENT(UInt16)
ABSENT(UInt32)
ABSENT(Int64)
ABSENT(UInt64)
ABSENT(String)

fmi3Status fmi3GetBinary(fmi3Instance c, REFERENCES, size_t sizes[], fmi3Binary values[], size_t n_values) {
    return absent(c, "Binary", vr, n);
}

fmi3Status fmi3SetBinary(fmi3Instance c, REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t n_values) {
    return absent(c, "Binary", vr, n);
}

/* --- clocks --- */

#define NO_CLOCKS "there are no clocks"

REFUSED(fmi3GetClock, NO_CLOCKS, REFERENCES, fmi3Clock values[])
REFUSED(fmi3SetClock, NO_CLOCKS, REFERENCES, const fmi3Clock values[])
REFUSED(fmi3GetIntervalDecimal, NO_CLOCKS, REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetIntervalFraction, NO_CLOCKS, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
        fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetShiftDecimal, NO_CLOCKS, REFERENCES, fmi3Float64 shifts[])
REFUSED(fmi3GetShiftFraction, NO_CLOCKS, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
REFUSED(fmi3SetIntervalDecimal, NO_CLOCKS, REFERENCES, const fmi3Float64 intervals[])
REFUSED(fmi3SetIntervalFraction, NO_CLOCKS, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3SetShiftDecimal, NO_CLOCKS, REFERENCES, const fmi3Float64 shifts[])
REFUSED(fmi3SetShiftFraction, NO_CLOCKS, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3ActivateModelPartition, NO_CLOCKS, fmi3ValueReference clock, fmi3Float64 time)

/* --- modes --- */

#define NO_EVENTS "there is no Event Mode (hasEventMode is false)"
#define NO_STRUCTURE "there are no structural parameters"

REFUSED_ALWAYS(fmi3EnterEventMode, NO_EVENTS)
REFUSED_ALWAYS(fmi3EnterStepMode, NO_EVENTS)
REFUSED_ALWAYS(fmi3EvaluateDiscreteStates, NO_EVENTS)
REFUSED(fmi3UpdateDiscreteStates, NO_EVENTS, fmi3Boolean *need_update, fmi3Boolean *terminate,
        fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *next_time_defined,
        fmi3Float64 *next_time)
REFUSED_ALWAYS(fmi3EnterConfigurationMode, NO_STRUCTURE)
REFUSED_ALWAYS(fmi3ExitConfigurationMode, NO_STRUCTURE)

/* --- capabilities --- */

#define NO_DEPENDENCIES "see the model description (providesPerElementDependencies is false)"

REFUSED(fmi3GetNumberOfVariableDependencies, NO_DEPENDENCIES, fmi3ValueReference vr, size_t *n)
REFUSED(fmi3GetVariableDependencies, NO_DEPENDENCIES, fmi3ValueReference vr, size_t of_dependent[],
        fmi3ValueReference independents[], size_t of_independents[], fmi3DependencyKind kinds[], size_t n)
REFUSED(fmi3GetOutputDerivatives, "the outputs have no derivatives (maxOutputDerivativeOrder is 0)", REFERENCES,
        const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values)

/* --- Model Exchange --- */

#define NO_EXCHANGE "this FMU is for Co-Simulation, not for Model Exchange"

REFUSED_ALWAYS(fmi3EnterContinuousTimeMode, NO_EXCHANGE)
REFUSED(fmi3CompletedIntegratorStep, NO_EXCHANGE, fmi3Boolean no_set_state_before, fmi3Boolean *enter_event_mode,
        fmi3Boolean *terminate)
REFUSED(fmi3SetTime, NO_EXCHANGE, fmi3Float64 time)
REFUSED(fmi3SetContinuousStates, NO_EXCHANGE, const fmi3Float64 states[], size_t n)
REFUSED(fmi3GetContinuousStateDerivatives, NO_EXCHANGE, fmi3Float64 derivatives[], size_t n)
REFUSED(fmi3GetEventIndicators, NO_EXCHANGE, fmi3Float64 indicators[], size_t n)
REFUSED(fmi3GetContinuousStates, NO_EXCHANGE, fmi3Float64 states[], size_t n)
REFUSED(fmi3GetNominalsOfContinuousStates, NO_EXCHANGE, fmi3Float64 nominals[], size_t n)
REFUSED(fmi3GetNumberOfEventIndicators, NO_EXCHANGE, size_t *n)
REFUSED(fmi3GetNumberOfContinuousStates, NO_EXCHANGE, size_t *n)
