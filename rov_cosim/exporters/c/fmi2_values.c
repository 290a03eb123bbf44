/* FMI 2.0: variables and derivatives. */
#include "fmi2Functions.h"
#include "slave.h"

static double element(Type type, const void *values, size_t i) {
    if (type == REAL)
        return ((const fmi2Real *)values)[i];
    if (type == INTEGER)
        return ((const fmi2Integer *)values)[i];
    return ((const fmi2Boolean *)values)[i] != fmi2False;
}

/* Check the references of a get or set; all arguments may be NULL if there are none. */
static int are_variables(Slave *slave, Call call, Type type, const fmi2ValueReference vr[], size_t n,
                         const void *values) {
    if (n && !(given(slave, call, vr, "vr") && given(slave, call, values, "value")))
        return 0;
    for (size_t i = 0; i < n; i++) {
        if (!is_variable(vr[i], type)) {
            why_not_variable(&slave->instance, vr[i], type);
            report(slave, fmi2Error);
            return 0;
        }
    }
    return 1;
}

static fmi2Status get(fmi2Component c, Call call, Type type, const fmi2ValueReference vr[], size_t n,
                      void *values) {
    Slave *slave = called(c, call);
    if (!slave || !are_variables(slave, call, type, vr, n, values))
        return fmi2Error;
    for (size_t i = 0; i < n && awaits_preview(&slave->instance); i++)
        if (is_output(vr[i]) && HELD(slave, preview(&slave->instance)) != fmi2OK)
            return fmi2Error;
    const double *from = slave->instance.now.values;
    if (type == REAL)
        for (size_t i = 0; i < n; i++)
            ((fmi2Real *)values)[i] = from[vr[i]];
    else
        for (size_t i = 0; i < n; i++)
            ((fmi2Integer *)values)[i] = (fmi2Integer)from[vr[i]]; /* a Boolean is an int too */
    return fmi2OK;
}

/* Set all values, or none if one is refused. */
static fmi2Status set(fmi2Component c, Call call, Type type, const fmi2ValueReference vr[], size_t n,
                      const void *values) {
    Slave *slave = called(c, call);
    if (!slave || !are_variables(slave, call, type, vr, n, values))
        return fmi2Error;
    for (size_t i = 0; i < n; i++) {
        if (!is_settable(&slave->instance, vr[i], element(type, values, i))) {
            why_not_settable(&slave->instance, vr[i], element(type, values, i));
            return report(slave, fmi2Error);
        }
    }
    for (size_t i = 0; i < n; i++)
        if (!assign(&slave->instance, vr[i], element(type, values, i)))
            return report(slave, fmi2Error);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    return get(c, GET_REAL, REAL, vr, nvr, value);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    return get(c, GET_INTEGER, INTEGER, vr, nvr, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    return get(c, GET_BOOLEAN, BOOLEAN, vr, nvr, value);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    return get(c, GET_STRING, STRING, vr, nvr, value); /* there is none */
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    return set(c, SET_REAL, REAL, vr, nvr, value);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    return set(c, SET_INTEGER, INTEGER, vr, nvr, value);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    return set(c, SET_BOOLEAN, BOOLEAN, vr, nvr, value);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    return set(c, SET_STRING, STRING, vr, nvr, value);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    Slave *slave = called(c, SET_RATES);
    if (!slave || !are_variables(slave, SET_RATES, REAL, vr, nvr, value))
        return fmi2Error;
    if (nvr && !given(slave, SET_RATES, order, "order"))
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++) {
        if (!is_rate_settable(&slave->instance, vr[i], value[i]))
            return report(slave, fmi2Error);
        if (order[i] != 1)
            return refuse(slave, "The derivative of %s is of order %d; expected the first.", variables[vr[i]].name,
                          order[i]);
    }
    for (size_t i = 0; i < nvr; i++)
        assign_rate(&slave->instance, vr[i], value[i]);
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    Slave *slave = called(c, GET_RATES);
    (void)vr, (void)order, (void)value;
    if (!slave || nvr == 0)
        return slave ? fmi2OK : fmi2Error;
    return refuse(slave, "The outputs have no derivatives (maxOutputDerivativeOrder is 0).");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real change[],
                                        fmi2Real derivative[]) {
    Slave *slave = called(c, DERIVATIVE);
    double du[N_U + 1] = {0}, dy[N_Y + 1]; /* there may be none */
    if (!slave || !are_variables(slave, DERIVATIVE, REAL, unknown, n_unknown, derivative)
        || !are_variables(slave, DERIVATIVE, REAL, known, n_known, change))
        return fmi2Error;
    for (size_t i = 0; i < n_unknown; i++)
        if (!is_unknown(slave, unknown[i]))
            return fmi2Error;
    for (size_t i = 0; i < n_known; i++)
        if (!is_known(slave, known[i]) || !add_change(slave, known[i], change[i], &du[known[i]]))
            return fmi2Error;
    if (HELD(slave, directional_derivative(&slave->instance, du, dy)) != fmi2OK)
        return fmi2Error;
    for (size_t i = 0; i < n_unknown; i++)
        if (!has_derivative(slave, unknown[i], dy[unknown[i] - N_U]))
            return fmi2Discard;
    for (size_t i = 0; i < n_unknown; i++)
        derivative[i] = dy[unknown[i] - N_U];
    return fmi2OK;
}
