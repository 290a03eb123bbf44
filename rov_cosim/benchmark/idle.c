/* An FMU that does nothing: what calling it costs is what any FMU with these variables costs a master.

   The arguments are left out, which the C language does not allow, but the platforms' calling conventions do. */
#define VISIBLE __attribute__((visibility("default")))
#define NOTHING(name) VISIBLE int name(void) { return 0; }

static char component;

VISIBLE void *fmi2Instantiate(void) { return &component; }
VISIBLE void fmi2FreeInstance(void) {}
VISIBLE const char *fmi2GetVersion(void) { return "2.0"; }
VISIBLE const char *fmi2GetTypesPlatform(void) { return "default"; }

NOTHING(fmi2CancelStep)
NOTHING(fmi2DeSerializeFMUstate)
NOTHING(fmi2DoStep)
NOTHING(fmi2EnterInitializationMode)
NOTHING(fmi2ExitInitializationMode)
NOTHING(fmi2FreeFMUstate)
NOTHING(fmi2GetBoolean)
NOTHING(fmi2GetBooleanStatus)
NOTHING(fmi2GetDirectionalDerivative)
NOTHING(fmi2GetFMUstate)
NOTHING(fmi2GetInteger)
NOTHING(fmi2GetIntegerStatus)
NOTHING(fmi2GetReal)
NOTHING(fmi2GetRealOutputDerivatives)
NOTHING(fmi2GetRealStatus)
NOTHING(fmi2GetStatus)
NOTHING(fmi2GetString)
NOTHING(fmi2GetStringStatus)
NOTHING(fmi2Reset)
NOTHING(fmi2SerializeFMUstate)
NOTHING(fmi2SerializedFMUstateSize)
NOTHING(fmi2SetBoolean)
NOTHING(fmi2SetDebugLogging)
NOTHING(fmi2SetFMUstate)
NOTHING(fmi2SetInteger)
NOTHING(fmi2SetReal)
NOTHING(fmi2SetRealInputDerivatives)
NOTHING(fmi2SetString)
NOTHING(fmi2SetupExperiment)
NOTHING(fmi2Terminate)
