/* The same for FMI 3.0: arrays, and what it alone has. */
#define getState fmi3GetFMUState
#define setState fmi3SetFMUState
#define freeState fmi3FreeFMUState
#define stateSize fmi3SerializedFMUStateSize
#define serializeState(c, state, bytes, n) fmi3SerializeFMUState(c, state, (fmi3Byte *)(bytes), n)
#define deserializeState(c, bytes, n, state) fmi3DeserializeFMUState(c, (const fmi3Byte *)(bytes), n, state)
#define setDebugLogging fmi3SetDebugLogging
#define exitInitialization fmi3ExitInitializationMode
#define terminateRun fmi3Terminate
#define resetInstance fmi3Reset
#define freeInstance fmi3FreeInstance

static unsigned first_of(unsigned reference) {
    while (!arrays[reference].name)
        reference--;
    return reference;
}

static size_t size_from(uint32_t reference) {
    return reference < N_VARIABLES && arrays[reference].name ? arrays[reference].size : 1;
}

static int get(void *c, Type type, List a) {
    bool *truths = a.ints ? calloc(a.n_values, sizeof *truths) : NULL;
    int status = type == REAL    ? fmi3GetFloat64(c, a.vr, a.n, a.reals, a.n_values)
               : type == INTEGER ? fmi3GetInt32(c, a.vr, a.n, a.ints, a.n_values)
               : type == BOOLEAN ? fmi3GetBoolean(c, a.vr, a.n, truths, a.n_values)
                                 : fmi3GetString(c, a.vr, a.n, a.names, a.n_values);
    for (size_t i = 0; truths && type == BOOLEAN && i < a.n_values; i++)
        a.ints[i] = truths[i];
    free(truths);
    return status;
}

static int set(void *c, Type type, List a) {
    bool *truths = a.ints ? calloc(a.n_values, sizeof *truths) : NULL;
    for (size_t i = 0; truths && i < a.n_values; i++)
        truths[i] = a.ints[i] & 1;
    int status = type == REAL    ? fmi3SetFloat64(c, a.vr, a.n, a.reals, a.n_values)
               : type == INTEGER ? fmi3SetInt32(c, a.vr, a.n, a.ints, a.n_values)
               : type == BOOLEAN ? fmi3SetBoolean(c, a.vr, a.n, truths, a.n_values)
                                 : fmi3SetString(c, a.vr, a.n, a.names, a.n_values);
    free(truths);
    return status;
}

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    heed(environment, (int)status, category, message);
}

static void *new_instance(int sane, const char *name, const char *known_guid, int logged, int *fine, int *has_logger) {
    fmi3LogMessageCallback logger = sane || byte() % 16 ? log_message : NULL;
    unsigned odd = sane ? 255 : byte();
    const fmi3ValueReference between = 0;
    *has_logger = logger != NULL;
    *fine = *fine && odd > 3;
    if (odd == 0)
        return fmi3InstantiateModelExchange(name, known_guid, NULL, false, logged, told, logger);
    if (odd == 1)
        return fmi3InstantiateScheduledExecution(name, known_guid, NULL, false, logged, told, logger, NULL, NULL, NULL);
    return fmi3InstantiateCoSimulation(name, known_guid, NULL, byte() % 2, logged, odd == 2, byte() % 2, &between, odd == 3, told,
                                       logger, NULL);
}

static int enter(void *c) {
    return fmi3EnterInitializationMode(c, byte() % 2, real(0), real(0), byte() % 2, real(0));
}

static int enter_at(int k, double start_time) {
    return fmi3EnterInitializationMode(instances[k], false, 0, start_time, false, 0);
}

static int do_step_of(void *c, double time, double size) {
    bool event = true, terminate = true, early = true;
    double last = NAN;
    int status = fmi3DoStep(c, time, size, byte() % 2, &event, &terminate, &early, &last);
    EXPECT(status != OK || !(event || terminate || early));
    EXPECT(status != OK || fabs(last - (time + size)) <= 1e-6 * fmax(1, fabs(time)));
    return status;
}

static int derivative(void *c, List unknown, List known_, double *result) {
    return fmi3GetDirectionalDerivative(c, unknown.vr, unknown.n, known_.vr, known_.n, known_.reals, known_.n_values, result,
                                        unknown.n_values);
}

enum { OWN = 7 };

static void own(int k, unsigned operation) {
    void *c = instances[k];
    const double now = known[k].state.time + known[k].state.skew;
    const fmi3ValueReference time_reference = TIME;
    double time, zero = 0;
    size_t n;
    bool truth;
    List a, b;
    switch (operation) {
    case 0:
        EXPECT(after(k, fmi3GetFloat64(c, &time_reference, 1, or_null(&time), 1)) != OK || time == now);
        after(k, fmi3SetFloat64(c, &time_reference, 1, &zero, 1));
        break;
    case 1:
        a = list(REAL, 0, N_U + 1), b = list(REAL, N_U - 1, N_Y + 2);
        if (after(k, fmi3GetAdjointDerivative(c, b.vr, b.n, a.vr, a.n, b.reals, b.n_values, a.reals, a.n_values)) == OK)
            for (size_t i = 0; i < a.n_values; i++)
                EXPECT(isfinite(a.reals[i]));
        break;
    case 2: a = list(REAL, 0, N_VARIABLES), after(k, fmi3GetFloat32(c, a.vr, a.n, NULL, 0)); break;
    case 3: after(k, fmi3EnterEventMode(c)), after(k, fmi3EnterStepMode(c)), after(k, fmi3EnterConfigurationMode(c)); break;
    case 4:
        a = list(REAL, N_U, N_Y);
        after(k, fmi3GetOutputDerivatives(c, a.vr, a.n, a.ints, a.reals, a.n_values));
        after(k, fmi3GetClock(c, a.vr, a.n, &truth));
        break;
    case 5: after(k, fmi3GetNumberOfContinuousStates(c, &n)), after(k, fmi3SetTime(c, real(0))); break;
    case 6: EXPECT(after(k, fmi3DoStep(c, now, period(&known[k].state), true, &truth, &truth, &truth, NULL)) == REFUSED); break;
    }
}
