/* Holds a small 4-DOF vehicle with the binary in adaptive_pd.fmu; C99.

   closed_loop LIBRARY

   Axes are right-handed with z up; the pose is x, y, z, roll, pitch, yaw in m and rad, the velocity is in the body. In the
   place of `advance` comes your vehicle: it tells its pose and takes eight thrusters' forces. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "adaptive_pd.h"
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

#define CALL(name) ((name##TYPE *)find(library, #name))

enum { STEPS = 2800, THRUSTERS = adaptive_pd_u_count };
static const double PI = 3.14159265358979323846;

static void *library;

static void *find(void *from, const char *name) {
    void *function = FIND(from, name);
    if (!function) {
        fprintf(stderr, "The library has no function %s.\n", name);
        exit(2);
    }
    return function;
}

static void must(fmi2Status status, const char *call) {
    if (status > fmi2Warning) {
        fprintf(stderr, "%s failed.\n", call);
        exit(2);
    }
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                        fmi2String category, fmi2String message, ...) {
    (void)environment, (void)status;
    fprintf(stderr, "%s %s: %s\n", instance, category, message);
}

/* Surge, sway, heave and yaw of the paper's vehicle, 80 kg, pressed by a buoy, an umbilical and an arm. */
static const double M[4] = {120, 128, 136, 14.7}; /* with added mass, in kg and kg m^2 */
static const double D[4] = {130, 195, 286, 10.18}; /* quadratic */
static const double FORCE[3] = {2, -8, 25}, MOMENT = -2; /* earth frame, N and N m */

typedef struct {
    double eta[4], nu[4], B[4][THRUSTERS]; /* x, y, z, yaw; the wrench X, Y, Z, N of 1 N of each thruster */
} Vehicle;

static void advance(Vehicle *v, const double u[THRUSTERS], double time) {
    for (int n = 0; n < 10; n++) {
        double c = cos(v->eta[3]), s = sin(v->eta[3]), nu[4], wrench[4];
        memcpy(nu, v->nu, sizeof nu);
        double load[4] = {c * FORCE[0] + s * FORCE[1], -s * FORCE[0] + c * FORCE[1], FORCE[2], MOMENT};
        double coriolis[4] = {-M[1] * nu[1] * nu[3], M[0] * nu[0] * nu[3], 0, (M[1] - M[0]) * nu[0] * nu[1]};
        for (int i = 0; i < 4; i++) {
            wrench[i] = load[i] - coriolis[i] - D[i] * fabs(nu[i]) * nu[i];
            for (int k = 0; k < THRUSTERS; k++)
                wrench[i] += v->B[i][k] * u[k];
            v->nu[i] += time / 10 * wrench[i] / M[i];
        }
        v->eta[0] += time / 10 * (c * v->nu[0] - s * v->nu[1]);
        v->eta[1] += time / 10 * (s * v->nu[0] + c * v->nu[1]);
        v->eta[2] += time / 10 * v->nu[2];
        v->eta[3] += time / 10 * v->nu[3];
    }
}

int main(int argc, char **argv) {
    fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};
    Vehicle v = {{0, 0.5, 0, 2}, {0}, {{0}}};
    double r[THRUSTERS][3], d[THRUSTERS][3], u[THRUSTERS], worst = 0, worst_yaw = 0;
    const fmi2Boolean valid = fmi2True;
    if (argc != 2 || !(library = LOAD(argv[1]))) {
        fprintf(stderr, "usage: closed_loop LIBRARY\n");
        return 2;
    }
    fmi2Component c = CALL(fmi2Instantiate)("controller", fmi2CoSimulation, ADAPTIVE_PD_GUID, "", &callbacks, 0, 1);
    if (!c)
        return 2;
    must(CALL(fmi2SetupExperiment)(c, 0, 0, 0, 0, 0), "fmi2SetupExperiment");
    must(CALL(fmi2EnterInitializationMode)(c), "fmi2EnterInitializationMode");
    must(CALL(fmi2ExitInitializationMode)(c), "fmi2ExitInitializationMode");
    must(CALL(fmi2GetReal)(c, adaptive_pd_thruster_r, adaptive_pd_thruster_r_count, r[0]), "fmi2GetReal");
    must(CALL(fmi2GetReal)(c, adaptive_pd_thruster_d, adaptive_pd_thruster_d_count, d[0]), "fmi2GetReal");
    for (int k = 0; k < THRUSTERS; k++) {
        for (int i = 0; i < 3; i++)
            v.B[i][k] = d[k][i];
        v.B[3][k] = r[k][0] * d[k][1] - r[k][1] * d[k][0];
    }
    must(CALL(fmi2SetBoolean)(c, adaptive_pd_eta_m_valid, 1, &valid), "fmi2SetBoolean");
    for (int n = 0; n < STEPS; n++) {
        double pose[6] = {v.eta[0], v.eta[1], v.eta[2], 0, 0, v.eta[3]};
        must(CALL(fmi2SetReal)(c, adaptive_pd_eta_m, adaptive_pd_eta_m_count, pose), "fmi2SetReal");
        must(CALL(fmi2DoStep)(c, n * ADAPTIVE_PD_STEP, ADAPTIVE_PD_STEP, fmi2True), "fmi2DoStep");
        must(CALL(fmi2GetReal)(c, adaptive_pd_u, adaptive_pd_u_count, u), "fmi2GetReal");
        advance(&v, u, ADAPTIVE_PD_STEP);
        if (n >= STEPS - STEPS / 5) {
            worst = fmax(worst, sqrt(v.eta[0] * v.eta[0] + v.eta[1] * v.eta[1] + v.eta[2] * v.eta[2]));
            worst_yaw = fmax(worst_yaw, fabs(remainder(v.eta[3], 2 * PI)));
        }
    }
    CALL(fmi2FreeInstance)(c);
    int held = worst < 0.01 && worst_yaw < PI / 180;
    printf("%s: %.1f mm, %.1f deg\n", held ? "held" : "lost", 1e3 * worst, worst_yaw * 180 / PI);
    return !held;
}
