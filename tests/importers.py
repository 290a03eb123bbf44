"""Other tools driving a system archive, each in a process of its own: python importers.py TOOL ARCHIVE STOP OUT.npz."""

import sys

import numpy as np

STEP = 0.03
SIGNALS = [f"rov_plant.eta.{axis}" for axis in ("x", "y", "z", "psi")] + [
    "rov_plant.nu.u",
    "passive_arm.eta_m.y",
    "adaptive_pd.theta_hat.dB",
    "adaptive_pd.u[1]",
]


def ecos(path: str, steps: int) -> np.ndarray:
    """Ecos, by ecospy; its wheel leaves libtbb to the system, and PyPI has it."""
    import ctypes
    from importlib.metadata import files

    (tbb,) = [file for file in files("tbb") or () if file.name == "libtbb.so.12"]
    ctypes.CDLL(str(tbb.locate().resolve()), mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation

    names = ["::".join(name.split(".", 1)) for name in SIGNALS]
    with EcosSimulation(step_size=STEP, ssp_path=path) as simulation:
        simulation.init(0, "nominal")
        rows = [[simulation.get_real(name) for name in names]]
        for _ in range(steps):
            simulation.step()
            rows.append([simulation.get_real(name) for name in names])
        simulation.terminate()
    return np.array(rows)


def libcosim(path: str, steps: int) -> np.ndarray:
    """libcosim, by libcosimpy; the step size is that of the archive's annotation."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_ssp_file(ssp_path=path)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    places = []
    for name in SIGNALS:
        element, variable = name.split(".", 1)
        slave = execution.slave_index_from_instance_name(element)
        (reference,) = [v.reference for v in execution.slave_variables(slave) if v.name == variable.encode()]
        places.append((slave, reference))
    rows = []
    for _ in range(steps):
        assert execution.step()
        rows.append([observer.last_real_values(slave, [reference])[0] for slave, reference in places])
    assert execution.status().current_time == round(steps * STEP * 1e9)
    return np.array([[np.nan] * len(SIGNALS), *rows])  # it shows no values before the first step


if __name__ == "__main__":
    tool, path, stop, out = sys.argv[1:]
    np.savez(out, values={"ecos": ecos, "libcosim": libcosim}[tool](path, round(float(stop) / STEP)))
