"""A plain pythonfmu model, made without this project's exporter: y = gain * u + 1 + rate * t, t the end of the step."""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class PlainGain(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y, self.gain, self.rate, self.fail_at, self.started = 0.0, 0.0, 2.0, 0.0, 1e9, False
        parameter = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=self.output))
        self.register_variable(Real("gain", **parameter))
        self.register_variable(Real("rate", **parameter))
        self.register_variable(Real("fail_at", **parameter))
        self.register_variable(Boolean("started", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete))

    def output(self):
        return self.y if self.started else self.gain * self.u + 1.0

    def do_step(self, current_time, step_size):
        if current_time + step_size > self.fail_at:
            return False
        self.started = True
        self.y = self.gain * self.u + 1.0 + self.rate * (current_time + step_size)
        return True
