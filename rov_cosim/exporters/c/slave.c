#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

static void warn(void *slave, const char *message) {
    (void)message; /* it is the instance's */
    report(slave, WARNING);
}

Slave *new_slave(const char *name, int logging_on) {
    const char *known_name = name && *name ? name : "(without a name)";
    Slave *slave = calloc(1, sizeof *slave + strlen(known_name) + 1);
    if (!slave)
        return NULL;
    strcpy(slave->name, known_name);
    slave->logged = logging_on ? EVERY_CATEGORY : EVERY_CATEGORY & ~WARNINGS; /* why a call failed is always told */
    slave->instance.warn = warn;
    slave->instance.receiver = slave;
    if (known_name != name)
        say(slave->instance.message, "The name of the instance is empty.");
    return slave;
}

Slave *admitted(Slave *slave, const char *token, const char *given_guid, const char *resources) {
    char *reason = slave->instance.message;
    if (!*reason && (!given_guid || strcmp(given_guid, guid)))
        say(reason, "The %s is %.200s; expected %s: the model description is of another FMU.", token,
            given_guid ? given_guid : "NULL", guid);
    else if (!*reason)
        take_parts(&slave->instance, resources);
    if (*reason) {
        report(slave, REFUSED);
        free_slave(slave);
        return NULL;
    }
    reset(&slave->instance);
    return slave;
}

void free_slave(Slave *slave) {
    if (slave)
        drop_parts(&slave->instance);
    free(slave);
}

int choose_categories(Slave *slave, int on, size_t n, const char *const categories[]) {
    unsigned chosen = n ? 0 : EVERY_CATEGORY;
    if (n && !given(slave, SET_DEBUG_LOGGING, categories, "categories"))
        return REFUSED;
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
            return report(slave, REFUSED);
        }
    }
    slave->logged = on ? chosen : 0;
    return OK;
}

int report(Slave *slave, int status) {
    int category = status - WARNING;
    char *percent = slave->instance.message;
    while ((percent = strpbrk(percent, "%#")))
        *percent = '?'; /* of a name from outside; to a logger they are a format and a reference */
    if (slave->logged >> category & 1u && slave->logger)
        tell(slave, status, log_categories[category]);
    return status;
}

int refuse(Slave *slave, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(slave->instance.message, MESSAGE_SIZE, format, arguments);
    va_end(arguments);
    return report(slave, REFUSED);
}

int checked(Slave *slave, int fine) {
    return fine ? OK : report(slave, REFUSED);
}

Slave *called(void *component, Call call) {
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
    report(slave, REFUSED);
    return NULL;
}

int given(Slave *slave, Call call, const void *pointer, const char *argument) {
    if (!pointer)
        refuse(slave, "%s: the argument %s is NULL.", calls[call].name, argument);
    return pointer != NULL;
}

int is_unknown(Slave *slave, uint32_t reference) {
    if (!is_output(reference))
        refuse(slave, "%s is no output: derivatives are those of outputs.", variables[reference].name);
    return is_output(reference);
}

int is_known(Slave *slave, uint32_t reference) {
    if (reference >= N_U)
        refuse(slave, "%s is no input: derivatives are those for inputs.", variables[reference].name);
    return reference < N_U;
}

int add_change(Slave *slave, uint32_t reference, double change, double *sum) {
    if (!isfinite(change))
        refuse(slave, "The change of %s is not finite.", variables[reference].name);
    else
        *sum += change;
    return isfinite(change);
}

int has_derivative(Slave *slave, uint32_t reference, double derivative) {
    if (isfinite(derivative))
        return 1;
    say(slave->instance.message, "%s has no finite derivative here.", variables[reference].name);
    report(slave, DISCARD);
    return 0;
}
