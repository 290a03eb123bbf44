// Holds a vehicle, as closed_loop.c does, from a host in C++17 (Linux, macOS): host LIBRARY
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <dlfcn.h>
#include <stdexcept>
#include <string>
#include "adaptive_pd.h"
#include "fmi2FunctionTypes.h"

static void log_message(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String text, ...) {
    std::fprintf(stderr, "%s\n", text);
}

class Controller {
  public:
    explicit Controller(const char *path) : library(dlopen(path, RTLD_NOW | RTLD_LOCAL)) {
        static const fmi2CallbackFunctions callbacks{log_message, std::calloc, std::free, nullptr, nullptr};
        if (!library) throw std::runtime_error(dlerror());
        const auto instantiate = find<fmi2InstantiateTYPE>("fmi2Instantiate");
        instance = instantiate("controller", fmi2CoSimulation, ADAPTIVE_PD_GUID, "", &callbacks, fmi2False, fmi2True);
        call<fmi2SetupExperimentTYPE>("fmi2SetupExperiment", fmi2False, 0.0, 0.0, fmi2False, 0.0);
        call<fmi2EnterInitializationModeTYPE>("fmi2EnterInitializationMode");
        call<fmi2ExitInitializationModeTYPE>("fmi2ExitInitializationMode");
        const fmi2Boolean valid = fmi2True;
        call<fmi2SetBooleanTYPE>("fmi2SetBoolean", adaptive_pd_eta_m_valid, 1, &valid);
    }
    auto sample(const std::array<double, 6> &pose, double time) {
        std::array<double, adaptive_pd_u_count> u;
        call<fmi2SetRealTYPE>("fmi2SetReal", adaptive_pd_eta_m, pose.size(), pose.data());
        call<fmi2DoStepTYPE>("fmi2DoStep", time, ADAPTIVE_PD_STEP, fmi2True);
        call<fmi2GetRealTYPE>("fmi2GetReal", adaptive_pd_u, u.size(), u.data());
        return u;
    }

  private:
    void *library;
    fmi2Component instance;
    template <class Type> Type *find(const char *name) { return reinterpret_cast<Type *>(dlsym(library, name)); }
    template <class Type, class... Arguments> void call(const char *name, Arguments... arguments) {
        if (find<Type>(name)(instance, arguments...) > fmi2Warning) throw std::runtime_error(std::string(name) + " failed");
    }
};

int main(int argc, char **argv) {  // 120 kg and 14.7 kg m^2 with linear drag, under 25 N upwards, 8 N to starboard, -2 N m
    Controller controller(argc > 1 ? argv[1] : "");
    double x = 0, y = 0.5, z = 0, psi = 1, u = 0, v = 0, w = 0, r = 0, worst = 0, turned = 0;
    for (int n = 0; n < 2800; n++) {
        const auto f = controller.sample({x, y, z, 0, 0, psi}, n * ADAPTIVE_PD_STEP);
        const double a = std::sqrt(0.5), X = a * (f[0] + f[1] + f[2] + f[3]), Y = a * (f[1] + f[2] - f[0] - f[3]);
        const double N = 0.65 * a * (f[1] + f[3] - f[0] - f[2]), c = std::cos(psi), s = std::sin(psi), h = ADAPTIVE_PD_STEP;
        u += h * (c * X - s * Y - 60 * u) / 120, v += h * (s * X + c * Y - 60 * v - 8) / 120;
        w += h * (f[4] + f[5] + f[6] + f[7] - 80 * w + 25) / 120, r += h * (N - 4 * r - 2) / 14.7;
        x += h * u, y += h * v, z += h * w, psi += h * r;
        if (n >= 2240) worst = std::fmax(worst, std::hypot(x, y, z)), turned = std::fmax(turned, std::fabs(psi));
    }
    const bool held = worst < 0.01 && turned < 0.0175;
    std::printf("%s: %.1f mm, %.1f deg\n", held ? "held" : "lost", 1e3 * worst, turned * 180 / 3.14159265);
    return !held;
}
