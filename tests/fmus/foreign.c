/* An FMU of another make, whose instance misbehaves as its name says: HOW_in_FUNCTION, from the time 0.1 s on in doStep.

   r[0] is the time, r[1] an input, r[2] = r[1] as it was when the last step began, r[3] the number of steps, r[4] a state that can be
   given, r[5] what cannot be known; i[0] an enumeration, i[1] its copy; i[2] an input, i[3] = i[2] as it was when the last step
   began; s[0] a text, s[1] its copy, which is gone when an input is set: a host may use it until its next call. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2Functions.h"

typedef struct {
    fmi2CallbackFunctions host;
    char name[64], s[2][200];
    double r[6];
    int i[4];
} Model;

static int in_process; /* instances ever made: what a library keeps to itself */

static int overflow(int n) {
    volatile char room[4096] = {0};
    return n ? overflow(n + 1) + room[0] : 0;
}

static fmi2Status misbehave(Model *m, const char *function) {
    static char flood[1000001];
    char how[64] = "", where[64] = "";
    if (sscanf(m->name, "%63[a-z]_in_%63s", how, where) != 2 || strcmp(where, function))
        return fmi2OK;
    if (!strcmp(how, "crash"))
        *(volatile int *)8 = 1;
    if (!strcmp(how, "exit"))
        exit(3);
    if (!strcmp(how, "abort"))
        abort();
    if (!strcmp(how, "overflow"))
        overflow(1);
    if (!strcmp(how, "hang"))
        for (volatile int for_ever = 1; for_ever;)
            ;
    if (!strcmp(how, "close"))
        for (int fd = 0; fd < 64; fd++)
            close(fd);
    if (!strcmp(how, "chdir"))
        return chdir("/") ? fmi2Error : fmi2OK;
    if (!strcmp(how, "words"))
        m->host.logger(m->host.componentEnvironment, m->name, fmi2Error, "e", "valve %s stuck at %g bar", "V7", 3.5);
    if (!strcmp(how, "nothing"))
        m->host.logger(m->host.componentEnvironment, m->name, fmi2Error, NULL, NULL);
    if (!strcmp(how, "flood")) {
        memset(flood, 'x', sizeof flood - 1);
        m->host.logger(m->host.componentEnvironment, m->name, fmi2Error, "e", "%s", flood);
    }
    if (!strcmp(how, "lost")) /* it does not give back what it was given */
        m->host.logger(NULL, m->name, fmi2Error, "e", "who am I");
    if (!strcmp(how, "warn"))
        m->host.logger(m->host.componentEnvironment, m->name, fmi2Warning, "w", "the limit of %d is near", m->i[0]);
    if (!strcmp(how, "infinite"))
        m->r[5] = INFINITY;
    if (!strcmp(how, "report")) /* an error, and goes on */
        m->host.logger(m->host.componentEnvironment, m->name, fmi2Error, "e", "\x1b[31mthe pump\a is broken");
    if (!strcmp(how, "fork")) /* two go on */
        fork();
    if (!strcmp(how, "print")) {
        puts("said by the FMU");
        fflush(stdout);
    }
    if (!strcmp(how, "drift"))
        m->r[5]++;
    if (!strcmp(how, "pending"))
        return fmi2Pending;
    if (!strcmp(how, "odd"))
        return 77;
    if (strcmp(how, "words") && strcmp(how, "quiet") && strcmp(how, "nothing") && strcmp(how, "flood") && strcmp(how, "lost"))
        return fmi2OK;
    return fmi2Discard;
}

#define PASS(function) \
    do { \
        fmi2Status status = misbehave(m, function); \
        if (status > fmi2Warning) \
            return status; \
    } while (0)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String s[]) { return fmi2OK; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *host, fmi2Boolean visible, fmi2Boolean logging) {
    Model *m = calloc(1, sizeof *m);
    m->host = *host;
    snprintf(m->name, sizeof m->name, "%s", name);
    m->i[0] = 1;
    m->r[4] = ++in_process;
    if (misbehave(m, "instantiate") > fmi2Warning) {
        free(m);
        return NULL;
    }
    return m;
}

void fmi2FreeInstance(fmi2Component c) {
    misbehave(c, "free");
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real start, fmi2Boolean sd, fmi2Real stop) {
    Model *m = c;
    m->r[0] = start;
    PASS("setup");
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Model *m = c;
    PASS("enter");
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Model *m = c;
    PASS("exit");
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    Model *m = c;
    PASS("terminate");
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_set_before) {
    Model *m = c;
    if (fabs(time - m->r[0]) > 1e-9)
        return fmi2Error;
    if (time > 0.1)
        PASS("step");
    m->r[0] = time + step;
    m->r[2] = m->r[1];
    m->i[3] = m->i[2];
    m->r[3]++;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Real x[]) {
    Model *m = c;
    if (m->r[0] > 0.1)
        PASS("get");
    else
        PASS("begin");
    for (size_t k = 0; k < n; k++)
        x[k] = m->r[v[k]];
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Real x[]) {
    Model *m = c;
    if (m->r[0] > 0.1)
        PASS("set");
    memset(m->s[1], '#', sizeof m->s[1] - 1);
    for (size_t k = 0; k < n; k++)
        m->r[v[k]] = x[k];
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Integer x[]) {
    Model *m = c;
    m->i[1] = m->i[0];
    for (size_t k = 0; k < n; k++)
        x[k] = m->i[v[k]];
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer x[]) {
    Model *m = c;
    for (size_t k = 0; k < n; k++)
        m->i[v[k]] = x[k];
    return fmi2OK;
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String x[]) {
    Model *m = c;
    strcpy(m->s[1], m->s[0]);
    for (size_t k = 0; k < n; k++)
        x[k] = m->s[v[k]];
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String x[]) {
    Model *m = c;
    for (size_t k = 0; k < n; k++)
        snprintf(m->s[v[k]], sizeof m->s[0], "%s", x[k]);
    return fmi2OK;
}

#define NEVER(name, ...) \
    fmi2Status name(__VA_ARGS__) { return fmi2Error; }

NEVER(fmi2Reset, fmi2Component c)
NEVER(fmi2CancelStep, fmi2Component c)
NEVER(fmi2GetBoolean, fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Boolean x[])
NEVER(fmi2SetBoolean, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Boolean x[])
NEVER(fmi2GetStatus, fmi2Component c, const fmi2StatusKind k, fmi2Status *v)
NEVER(fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind k, fmi2Real *v)
NEVER(fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind k, fmi2Integer *v)
NEVER(fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v)
NEVER(fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind k, fmi2String *v)
NEVER(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
NEVER(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
NEVER(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
NEVER(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
NEVER(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
NEVER(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
NEVER(fmi2GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference u[], size_t n, const fmi2ValueReference k[], size_t m,
      const fmi2Real x[], fmi2Real y[])
NEVER(fmi2SetRealInputDerivatives, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[], const fmi2Real x[])
NEVER(fmi2GetRealOutputDerivatives, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[], fmi2Real x[])
