"""A model that takes its process with it at the end of its fuse, as a broken FMU may."""

import ctypes

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Crashing(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fuse = 0.0
        parameter = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("fuse", **parameter))
        groups = {"current": "x y z", "F_umbilical": "x y z", "eta_d": "x y z phi theta psi"}
        for name in (f"{group}.{axis}" for group, axes in groups.items() for axis in axes.split()):
            self.register_variable(Real(name, causality=Fmi2Causality.output, getter=lambda: 0.0))

    def do_step(self, current_time, step_size):
        if current_time >= self.fuse:
            ctypes.string_at(0)
        return True
