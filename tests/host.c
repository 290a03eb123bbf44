/* A host without Python: loads an FMU's binary, drives it with recorded inputs, compares the outputs with the recorded.

   host LIBRARY GUID RECORD STEP

   RECORD is text: the counts of Boolean inputs held true, Real inputs and Real outputs; the value references of each; then
   for each step the inputs set before it and the outputs expected after it. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#define LOAD(path) (void *)LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#else
#include <dlfcn.h>
#define LOAD(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#endif

enum { MOST = 64 };

static void stop(const char *reason, const char *detail) {
    fprintf(stderr, "%s %s\n", reason, detail);
    exit(1);
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                        fmi2String category, fmi2String message, ...) {
    (void)environment, (void)status;
    fprintf(stderr, "%s %s: %s\n", instance, category, message);
}

static void *find(void *library, const char *name) {
    void *function = FIND(library, name);
    if (!function)
        stop("The library has no function", name);
    return function;
}

static void must(fmi2Status status, const char *call) {
    if (status > fmi2Warning)
        stop("This call failed:", call);
}

static void read_references(FILE *record, int n, fmi2ValueReference *references) {
    for (int i = 0; i < n; i++)
        if (fscanf(record, "%u", &references[i]) != 1)
            stop("The record ends early.", "");
}

int main(int argc, char **argv) {
    void *library = argc == 5 ? LOAD(argv[1]) : NULL;
    FILE *record = argc == 5 ? fopen(argv[3], "r") : NULL;
    fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};
    fmi2ValueReference flags[MOST], inputs[MOST], outputs[MOST];
    fmi2Boolean yes = fmi2True;
    double u[MOST], y[MOST], expected, worst = 0, step = argc == 5 ? atof(argv[4]) : 0;
    int n_flags = 0, n_inputs = 0, n_outputs = 0, n = 0;
    if (!library || !record || fscanf(record, "%d %d %d", &n_flags, &n_inputs, &n_outputs) != 3
        || n_flags > MOST || n_inputs > MOST || n_outputs > MOST)
        stop("usage:", "host LIBRARY GUID RECORD STEP");
    read_references(record, n_flags, flags);
    read_references(record, n_inputs, inputs);
    read_references(record, n_outputs, outputs);
    fmi2SetRealTYPE *set = (fmi2SetRealTYPE *)find(library, "fmi2SetReal");
    fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)find(library, "fmi2GetReal");
    fmi2DoStepTYPE *do_step = (fmi2DoStepTYPE *)find(library, "fmi2DoStep");
    fmi2Component c = ((fmi2InstantiateTYPE *)find(library, "fmi2Instantiate"))("host", fmi2CoSimulation, argv[2], "",
                                                                               &callbacks, fmi2False, fmi2True);
    if (!c)
        stop("The FMU cannot be instantiated.", "");
    for (int i = 0; i < n_flags; i++)
        must(((fmi2SetBooleanTYPE *)find(library, "fmi2SetBoolean"))(c, &flags[i], 1, &yes), "fmi2SetBoolean");
    must(((fmi2SetupExperimentTYPE *)find(library, "fmi2SetupExperiment"))(c, 0, 0, 0, 0, 0), "fmi2SetupExperiment");
    must(((fmi2EnterInitializationModeTYPE *)find(library, "fmi2EnterInitializationMode"))(c), "enter");
    must(((fmi2ExitInitializationModeTYPE *)find(library, "fmi2ExitInitializationMode"))(c), "exit");
    for (; fscanf(record, "%lf", &u[0]) == 1; n++) {
        for (int i = 1; i < n_inputs; i++)
            if (fscanf(record, "%lf", &u[i]) != 1)
                stop("The record ends early.", "");
        must(set(c, inputs, (size_t)n_inputs, u), "fmi2SetReal");
        must(do_step(c, n * step, step, fmi2True), "fmi2DoStep");
        must(get(c, outputs, (size_t)n_outputs, y), "fmi2GetReal");
        for (int i = 0; i < n_outputs && fscanf(record, "%lf", &expected) == 1; i++)
            worst = fmax(worst, fabs(y[i] - expected));
    }
    ((fmi2FreeInstanceTYPE *)find(library, "fmi2FreeInstance"))(c);
    printf("%d steps, largest deviation %g\n", n, worst);
    return 0;
}
