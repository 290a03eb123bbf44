/* What fuzz.c calls by other names, or with other arguments, in FMI 2.0. */
#define getState fmi2GetFMUstate
#define setState fmi2SetFMUstate
#define freeState fmi2FreeFMUstate
#define stateSize fmi2SerializedFMUstateSize
#define serializeState fmi2SerializeFMUstate
#define deserializeState fmi2DeSerializeFMUstate
#define setDebugLogging fmi2SetDebugLogging
#define exitInitialization fmi2ExitInitializationMode
#define terminateRun fmi2Terminate
#define resetInstance fmi2Reset
#define freeInstance fmi2FreeInstance

/* The first element of the variable that an element belongs to, and how many there are from a value reference. */
static unsigned first_of(unsigned reference) {
    return reference;
}

static size_t size_from(uint32_t reference) {
    return (void)reference, 1;
}

static int get(void *c, Type type, List a) {
    return type == REAL    ? fmi2GetReal(c, a.vr, a.n, a.reals)
         : type == INTEGER ? fmi2GetInteger(c, a.vr, a.n, a.ints)
         : type == BOOLEAN ? fmi2GetBoolean(c, a.vr, a.n, a.ints)
                           : fmi2GetString(c, a.vr, a.n, a.names);
}

static int set(void *c, Type type, List a) {
    return type == REAL    ? fmi2SetReal(c, a.vr, a.n, a.reals)
         : type == INTEGER ? fmi2SetInteger(c, a.vr, a.n, a.ints)
         : type == BOOLEAN ? fmi2SetBoolean(c, a.vr, a.n, a.ints)
                           : fmi2SetString(c, a.vr, a.n, a.names);
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String message, ...) {
    EXPECT(*name);
    heed(environment, (int)status, category, message);
}

/* Return an instance, and whether there is to be one, and a logger. */
static void *new_instance(int sane, const char *name, const char *known_guid, int logged, int *fine, int *has_logger) {
    fmi2CallbackFunctions functions = {sane || byte() % 16 ? log_message : NULL, calloc, free, NULL, told};
    fmi2CallbackFunctions *callbacks = sane ? &functions : or_null(&functions);
    int type = sane || byte() % 16 ? fmi2CoSimulation : byte() - 1;
    *has_logger = callbacks && functions.logger;
    *fine = *fine && callbacks && type == fmi2CoSimulation;
    return fmi2Instantiate(name, (fmi2Type)type, known_guid, NULL, callbacks, byte() % 2, logged);
}

static int enter(void *c) {
    return fmi2EnterInitializationMode(c);
}

/* Begin a run at a time; in FMI 2.0 it is set before. */
static int enter_at(int k, double start_time) {
    EXPECT(after(k, fmi2SetupExperiment(instances[k], 0, 0, start_time, 0, 0)) == OK);
    return enter(instances[k]);
}

static int do_step_of(void *c, double time, double size) {
    return fmi2DoStep(c, time, size, fmi2False);
}

static int derivative(void *c, List unknown, List known_, double *result) {
    return fmi2GetDirectionalDerivative(c, unknown.vr, unknown.n, known_.vr, known_.n, known_.reals, result);
}

enum { OWN = 7 };

/* What FMI 2.0 alone has. */
static void own(int k, unsigned operation) {
    void *c = instances[k];
    const double now = known[k].state.time + known[k].state.skew;
    fmi2StatusKind kind = (fmi2StatusKind)(byte() % 5);
    fmi2Status status;
    double time;
    List a;
    switch (operation) {
    case 0: after(k, fmi2SetupExperiment(c, byte() % 2, real(0), real(0), byte() % 2, real(0))); break;
    case 1: a = list(REAL, 0, N_U + 1), after(k, fmi2SetRealInputDerivatives(c, a.vr, a.n, a.ints, a.reals)); break;
    case 2: a = list(REAL, N_U, N_Y), after(k, fmi2GetRealOutputDerivatives(c, a.vr, a.n, a.ints, a.reals)); break;
    case 3: after(k, fmi2GetStatus(c, kind, &status)), after(k, fmi2CancelStep(c)); break;
    case 4: EXPECT(after(k, fmi2GetRealStatus(c, kind, or_null(&time))) != OK || time == now); break;
    case 5: after(k, fmi2GetIntegerStatus(c, kind, &(int){0})), after(k, fmi2GetStringStatus(c, kind, &(fmi2String){0})); break;
    case 6: after(k, fmi2GetBooleanStatus(c, kind, or_null(&(int){0}))); break;
    }
}
