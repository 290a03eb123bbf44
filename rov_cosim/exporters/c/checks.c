#include <float.h>
#include <math.h>

#include "instance.h"

void say_range(Instance *instance, const char *before, int reference, double value) {
    const Variable *v = &variables[reference];
    char a[NUMBER_SIZE], b[NUMBER_SIZE], c[NUMBER_SIZE];
    int below = v->minimum != -DBL_MAX, above = v->maximum != DBL_MAX;
    say(instance->message, "%s%s is %s; expected a finite number", before, v->name, number(value, 6, a));
    if (below)
        append(instance->message, " of at least %s", number(v->minimum, 6, b));
    if (above)
        append(instance->message, " %s at most %s", below ? "and" : "of", number(v->maximum, 6, c));
    append(instance->message, ".");
}

const char *phase_name(int64_t phase) {
    return phase == INSTANTIATED ? "instantiated" : phase == INITIALIZING ? "initializing"
         : phase == RUNNING      ? "running"      : phase == TERMINATED   ? "terminated"   : "stopped by a failure";
}

void why_not_variable(Instance *instance, uint32_t reference, Type type) {
    static const char *const names[] = {"Real", "Integer", "Boolean", "String"};
    if (reference >= N_VARIABLES)
        say(instance->message, "There is no variable with value reference %lu; expected 0 to %d.", (unsigned long)reference,
            N_VARIABLES - 1);
    else
        say(instance->message, "%s (value reference %lu) is of type %s, not %s.", variables[reference].name,
            (unsigned long)reference, names[variables[reference].type], names[type]);
}

void why_not_settable(Instance *instance, uint32_t reference, double value) {
    if (!legal((int)reference, value))
        say_range(instance, "", (int)reference, value);
    else if (is_output(reference))
        say(instance->message, "%s is an output: only inputs and parameters can be set.", variables[reference].name);
    else
        say(instance->message, "%s is a fixed parameter: set it before the initialization ends.",
            variables[reference].name);
}

int set_times(Instance *instance, double start_time, double stop_time) {
    char start[NUMBER_SIZE], stop[NUMBER_SIZE];
    if (!isfinite(start_time) || !(stop_time >= start_time)) {
        say(instance->message, "The run is from %s s to %s s; expected finite times, the stop not before the start.",
            number(start_time, 9, start), number(stop_time, 9, stop));
        return 0;
    }
    instance->now.time = instance->now.start_time = start_time;
    instance->now.stop_time = stop_time;
    return 1;
}

double spacing(double time) {
    return nextafter(fabs(time), INFINITY) - fabs(time);
}

double leeway(double time, double step) {
    return SINGLE * fabs(time) <= step / 4 ? fmin(2 * SINGLE * fabs(time), step / 4) : 0;
}

static double rounding(const State *now) {
    return TIME_TOLERANCE * fmax(1.0, now->time - now->start_time) + 4 * spacing(now->time);
}

/* A host that keeps time in single precision rounds it at each step: the clock here goes on by the steps alone. */
double own_time(const Instance *instance, double time) {
    const State *now = &instance->now;
    return fabs(time - (now->time + now->skew)) <= rounding(now) ? time - now->skew : now->time;
}

int host_time(const Instance *instance, double *time) {
    *time = instance->now.time + instance->now.skew;
    return 1;
}

int is_step(Instance *instance, double time, double step) {
    const State *now = &instance->now;
    double expected = now->time + now->skew, tolerance = fmax(rounding(now), leeway(expected, step));
    char a[NUMBER_SIZE], b[NUMBER_SIZE];
    if (!(fabs(time - expected) <= tolerance && isfinite(tolerance))) {
        say(instance->message, "Expected the communication point %s s but was %s s.", number(expected, 9, a), number(time, 9, b));
        return 0;
    }
    if (!(step > 0 && isfinite(time + step))) {
        say(instance->message, "The step size is %s s; expected a positive number of seconds.", number(step, 6, a));
        return 0;
    }
    double begin = own_time(instance, time);
    if (fmin(begin, time) + step > now->stop_time + (begin == time ? rounding(now) : tolerance)) {
        say(instance->message, "The step ends at %s s; expected at most the stop time %s s.", number(time + step, 9, a),
            number(now->stop_time, 9, b));
        return 0;
    }
    return 1;
}
