/* A host without Python: drives an FMU's binary by a script and compares what comes with what the script expects.

   host LIBRARY GUID SCRIPT

   The lines of a script: `R 3 0.5`, `I 3 7`, `B 3 1` set the variable with value reference 3; `start 0` initializes; `step 0.03`
   takes a step; `= 20 1.5` and `? 20 1` expect a Real and a Boolean output; `end 200` is last. Status 0: all as expected. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

static const double TOLERANCE = 1e-6;

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

int main(int argc, char **argv) {
    void *library = argc == 4 ? LOAD(argv[1]) : NULL;
    FILE *script = argc == 4 ? fopen(argv[3], "r") : NULL;
    fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};
    double worst = 0, time = 0, number, value = 0;
    char word[16] = "", where[64] = "";
    int n = 0, whole;
    if (!library || !script)
        stop("usage:", "host LIBRARY GUID SCRIPT");
    fmi2SetRealTYPE *set_real = (fmi2SetRealTYPE *)find(library, "fmi2SetReal");
    fmi2SetIntegerTYPE *set_integer = (fmi2SetIntegerTYPE *)find(library, "fmi2SetInteger");
    fmi2SetBooleanTYPE *set_boolean = (fmi2SetBooleanTYPE *)find(library, "fmi2SetBoolean");
    fmi2GetRealTYPE *get_real = (fmi2GetRealTYPE *)find(library, "fmi2GetReal");
    fmi2GetBooleanTYPE *get_boolean = (fmi2GetBooleanTYPE *)find(library, "fmi2GetBoolean");
    fmi2DoStepTYPE *do_step = (fmi2DoStepTYPE *)find(library, "fmi2DoStep");
    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)find(library, "fmi2Instantiate");
    fmi2Component c = instantiate("host", fmi2CoSimulation, argv[2], "", &callbacks, fmi2False, fmi2True);
    if (!c)
        stop("The FMU cannot be instantiated.", "");
    while (fscanf(script, "%15s %lf", word, &number) == 2 && strcmp(word, "end")) {
        fmi2ValueReference vr = (fmi2ValueReference)number;
        if (!strcmp(word, "start")) {
            must(((fmi2SetupExperimentTYPE *)find(library, "fmi2SetupExperiment"))(c, 0, 0, number, 0, 0), "setup");
            must(((fmi2EnterInitializationModeTYPE *)find(library, "fmi2EnterInitializationMode"))(c), "enter");
            must(((fmi2ExitInitializationModeTYPE *)find(library, "fmi2ExitInitializationMode"))(c), "exit");
        } else if (!strcmp(word, "step")) {
            must(do_step(c, n * number, number, fmi2True), "fmi2DoStep");
            time = ++n * number;
        } else if (fscanf(script, "%lf", &value) != 1)
            stop("The script ends early.", "");
        whole = (int)value;
        if (*word == 'R')
            must(set_real(c, &vr, 1, &value), "fmi2SetReal");
        else if (*word == 'I' || *word == 'B')
            must((*word == 'I' ? set_integer : set_boolean)(c, &vr, 1, &whole), "fmi2SetInteger or fmi2SetBoolean");
        else if (*word == '=' || *word == '?') {
            must(*word == '=' ? get_real(c, &vr, 1, &number) : get_boolean(c, &vr, 1, &whole), "fmi2GetReal or Boolean");
            double deviation = fabs((*word == '=' ? number : whole) - value) / fmax(1, fabs(value));
            if (!where[0] && !(deviation <= TOLERANCE))
                snprintf(where, sizeof where, "; first: value reference %u at %g s", vr, time);
            worst = deviation <= worst ? worst : deviation;
        }
    }
    if (strcmp(word, "end") || (int)number != n || n == 0)
        stop("The script is cut:", argv[3]);
    ((fmi2FreeInstanceTYPE *)find(library, "fmi2FreeInstance"))(c);
    printf("%d steps, largest deviation %g%s\n", n, worst, where);
    return where[0] != 0;
}
