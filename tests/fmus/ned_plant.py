"""A vehicle as other tools have it, made without this project: z down, front-right-down body axes, other names.

Four degrees of freedom with linear damping, pushed by the body wrench `force` and a constant force in the earth frame.
"""

from math import cos, sin

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

MASS, INERTIA, DAMPING, YAW_DAMPING, SUBSTEPS = 100.0, 15.0, 60.0, 20.0, 30


class NedPlant(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.pose = dict.fromkeys(("x", "y", "z", "phi", "theta", "psi"), 0.0)
        self.force = dict.fromkeys("XYZKMN", 0.0)
        self.push = dict.fromkeys("xyz", 0.0)
        self.velocity = [0.0] * 4
        self.valid = True
        parameter = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Boolean("valid", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete))
        for group, names, declared in (
            ("pose", self.pose, {"causality": Fmi2Causality.output}),
            ("force", self.force, {"causality": Fmi2Causality.input}),
            ("push", self.push, parameter),
        ):
            for name in names:
                self._register(group, names, name, declared)
        for name in ("x", "y", "z", "psi"):
            self._register("start", self.pose, name, parameter)

    def _register(self, group, values, name, declared):
        def set_(value):
            values[name] = value

        self.register_variable(Real(f"{group}.{name}", getter=lambda: values[name], setter=set_, **declared))

    def do_step(self, current_time, step_size):
        h = step_size / SUBSTEPS
        for _ in range(SUBSTEPS):
            u, v, w, r = self.velocity
            c, s = cos(self.pose["psi"]), sin(self.pose["psi"])
            push = (c * self.push["x"] + s * self.push["y"], c * self.push["y"] - s * self.push["x"], self.push["z"])
            rates = [
                (self.force["X"] + push[0] - DAMPING * u) / MASS + r * v,
                (self.force["Y"] + push[1] - DAMPING * v) / MASS - r * u,
                (self.force["Z"] + push[2] - DAMPING * w) / MASS,
                (self.force["N"] - YAW_DAMPING * r) / INERTIA,
            ]
            self.velocity = [old + h * rate for old, rate in zip(self.velocity, rates, strict=True)]
            u, v, w, r = self.velocity
            moved = {"x": c * u - s * v, "y": s * u + c * v, "z": w, "psi": r}
            for name, rate in moved.items():
                self.pose[name] += h * rate
        return True
