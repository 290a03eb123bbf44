"""A plain pythonfmu model with a parameter of each type, and an output that shows what it was set to."""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real, String


class Mixed(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.level, self.count, self.on, self.file, self.mode, self.h = (
            0.0,
            1.0,
            1,
            False,
            "default.csv",
            1,
            0.5,
        )
        for name, kind in (("level", Real), ("count", Integer), ("on", Boolean), ("file", String), ("mode", Integer)):
            self.register_variable(kind(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
            seen = {"causality": Fmi2Causality.output, "getter": lambda name=name: getattr(self, name)}
            if kind is not Real:
                seen["variability"] = Fmi2Variability.discrete
            self.register_variable(kind(f"seen_{name}", **seen))
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=lambda: self.level * self.u))
        self.register_variable(Real("h", causality=Fmi2Causality.output, initial=Fmi2Initial.exact))

    def do_step(self, current_time, step_size):
        return True
