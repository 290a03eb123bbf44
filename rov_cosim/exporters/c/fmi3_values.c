/* FMI 3.0: variables and derivatives. An array is passed element by element, in row-major order. */
#include "fmi3Functions.h"
#include "fmi3_arrays.h"

static const char *const type_names[] = {"Float64", "Int32", "Boolean"}; /* by Type */

int refuse_reference(Slave *slave, uint32_t reference, const char *type) {
    if (reference == TIME)
        refuse(slave, "time (value reference %d) is the independent variable: it can be read, as Float64, and not set.", TIME);
    else if (reference > TIME || !arrays[reference].name)
        refuse(slave, "There is no variable with value reference %lu.", (unsigned long)reference);
    else
        refuse(slave, "%s (value reference %lu) is of type %s, not %s.", arrays[reference].name,
               (unsigned long)reference, type_names[variables[reference].type], type);
    return 0;
}

static int is_array(uint32_t reference, Type type) {
    return is_variable(reference, type) && arrays[reference].name;
}

static uint32_t size_of(uint32_t reference) {
    return reference == TIME ? 1 : arrays[reference].size;
}

/* Check the references and the number of values of a call; all arguments may be NULL if there are none. */
static int are_arrays(Slave *slave, Call call, Type type, const fmi3ValueReference vr[], size_t n, const void *values,
                      size_t n_values) {
    size_t expected = 0;
    if (n && !(given(slave, call, vr, "valueReferences") && given(slave, call, values, "values")))
        return 0;
    for (size_t i = 0; i < n; i++) {
        if (!is_array(vr[i], type) && !(vr[i] == TIME && call == GET_REAL))
            return refuse_reference(slave, vr[i], type_names[type]);
        expected += size_of(vr[i]);
    }
    if (n_values != expected)
        refuse(slave, "%s: there are %lu values; expected %lu, one for each element.", calls[call].name,
               (unsigned long)n_values, (unsigned long)expected);
    return n_values == expected;
}

static double element(Type type, const void *values, size_t i) {
    if (type == REAL)
        return ((const fmi3Float64 *)values)[i];
    if (type == INTEGER)
        return ((const fmi3Int32 *)values)[i];
    return ((const fmi3Boolean *)values)[i];
}

static void put(Type type, void *values, size_t i, double value) {
    if (type == REAL)
        ((fmi3Float64 *)values)[i] = value;
    else if (type == INTEGER)
        ((fmi3Int32 *)values)[i] = (fmi3Int32)value;
    else
        ((fmi3Boolean *)values)[i] = value != 0;
}

static fmi3Status get(fmi3Instance c, Call call, Type type, const fmi3ValueReference vr[], size_t n, void *values,
                      size_t n_values) {
    Slave *slave = called(c, call);
    if (!slave || !are_arrays(slave, call, type, vr, n, values, n_values))
        return fmi3Error;
    for (size_t i = 0; i < n && awaits_preview(&slave->instance); i++)
        if (is_output(vr[i]) && HELD(slave, preview(&slave->instance)) != fmi3OK)
            return fmi3Error;
    double time = 0;
    (void)HELD(slave, host_time(&slave->instance, &time));
    for (size_t i = 0, k = 0; i < n; i++) {
        const double *from = vr[i] == TIME ? &time : &slave->instance.now.values[vr[i]];
        for (uint32_t j = 0; j < size_of(vr[i]); j++)
            put(type, values, k++, from[j]);
    }
    return fmi3OK;
}

/* Set all values, or none if one is refused. */
static fmi3Status set(fmi3Instance c, Call call, Type type, const fmi3ValueReference vr[], size_t n, const void *values,
                      size_t n_values) {
    Slave *slave = called(c, call);
    if (!slave || !are_arrays(slave, call, type, vr, n, values, n_values))
        return fmi3Error;
    for (size_t i = 0, k = 0; i < n; i++) {
        for (uint32_t j = 0; j < size_of(vr[i]); j++, k++) {
            if (!is_settable(&slave->instance, vr[i] + j, element(type, values, k))) {
                why_not_settable(&slave->instance, vr[i] + j, element(type, values, k));
                return report(slave, fmi3Error);
            }
        }
    }
    for (size_t i = 0, k = 0; i < n; i++)
        for (uint32_t j = 0; j < size_of(vr[i]); j++)
            if (!assign(&slave->instance, vr[i] + j, element(type, values, k++)))
                return report(slave, fmi3Error);
    return fmi3OK;
}

#define TYPE(name, call, type)                                                                                         \
    fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##name values[],             \
                             size_t n_values) {                                                                        \
        return get(c, GET_##call, type, vr, n, values, n_values);                                                      \
    }                                                                                                                  \
    fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##name values[],       \
                             size_t n_values) {                                                                        \
        return set(c, SET_##call, type, vr, n, values, n_values);                                                      \
    }

TYPE(Float64, REAL, REAL)
TYPE(Int32, INTEGER, INTEGER)
TYPE(Boolean, BOOLEAN, BOOLEAN)

/* Check the arguments of a call for derivatives of outputs for inputs. */
static int are_derivatives(Slave *slave, Call call, const fmi3ValueReference unknown[], size_t n_unknown,
                           const double *of_unknown, size_t n_of_unknown, const fmi3ValueReference known[],
                           size_t n_known, const double *of_known, size_t n_of_known) {
    if (!are_arrays(slave, call, REAL, unknown, n_unknown, of_unknown, n_of_unknown)
        || !are_arrays(slave, call, REAL, known, n_known, of_known, n_of_known))
        return 0;
    for (size_t i = 0; i < n_unknown; i++)
        if (!is_unknown(slave, unknown[i]))
            return 0;
    for (size_t i = 0; i < n_known; i++)
        if (!is_known(slave, known[i]))
            return 0;
    return 1;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t n_unknown,
                                        const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    Slave *slave = called(c, DERIVATIVE);
    double du[N_U + 1] = {0}, dy[N_Y + 1]; /* there may be none */
    if (!slave || !are_derivatives(slave, DERIVATIVE, unknown, n_unknown, sensitivity, n_sensitivity, known, n_known,
                                   seed, n_seed))
        return fmi3Error;
    for (size_t i = 0, k = 0; i < n_known; i++)
        for (uint32_t j = 0; j < size_of(known[i]); j++)
            if (!add_change(slave, known[i] + j, seed[k++], &du[known[i] + j]))
                return fmi3Error;
    if (HELD(slave, directional_derivative(&slave->instance, du, dy)) != fmi3OK)
        return fmi3Error;
    for (size_t i = 0; i < n_unknown; i++)
        for (uint32_t j = 0; j < size_of(unknown[i]); j++)
            if (!has_derivative(slave, unknown[i] + j, dy[unknown[i] + j - N_U]))
                return fmi3Discard;
    for (size_t i = 0, k = 0; i < n_unknown; i++)
        for (uint32_t j = 0; j < size_of(unknown[i]); j++)
            sensitivity[k++] = dy[unknown[i] + j - N_U];
    return fmi3OK;
}

/* Work out the derivative of a weighted sum of outputs for an input. */
static APART int weighted_derivative(Instance *instance, const double *weights, uint32_t input, double *sum) {
    double du[N_U + 1] = {0}, dy[N_Y + 1];
    du[input] = 1;
    if (!directional_derivative(instance, du, dy))
        return 0;
    *sum = 0;
    for (int y = 0; y < N_Y; y++)
        *sum += weights[y] != 0 ? weights[y] * dy[y] : 0; /* what is not asked for may be infinite */
    return 1;
}

/* By a directional derivative for each input: there are few. */
fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t n_unknown,
                                    const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    Slave *slave = called(c, ADJOINT);
    double weights[N_Y + 1] = {0}, gradient[N_U + 1] = {0};
    if (!slave || !are_derivatives(slave, ADJOINT, unknown, n_unknown, seed, n_seed, known, n_known, sensitivity,
                                   n_sensitivity))
        return fmi3Error;
    for (size_t i = 0, k = 0; i < n_unknown; i++)
        for (uint32_t j = 0; j < size_of(unknown[i]); j++)
            if (!add_change(slave, unknown[i] + j, seed[k++], &weights[unknown[i] + j - N_U]))
                return fmi3Error;
    for (size_t i = 0; i < n_known; i++) {
        for (uint32_t j = 0; j < size_of(known[i]); j++) {
            double *sum = &gradient[known[i] + j];
            if (HELD(slave, weighted_derivative(&slave->instance, weights, known[i] + j, sum)) != fmi3OK)
                return fmi3Error;
            if (!has_derivative(slave, known[i] + j, *sum))
                return fmi3Discard;
        }
    }
    for (size_t i = 0, k = 0; i < n_known; i++)
        for (uint32_t j = 0; j < size_of(known[i]); j++)
            sensitivity[k++] = gradient[known[i] + j];
    return fmi3OK;
}
