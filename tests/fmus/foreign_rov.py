"""A vehicle of another make: own names, north, east and depth, heading in degrees from 0 to 360, the wrench as input.

It declares no units, as plain pythonfmu has none. Four degrees of freedom with linear damping, pushed by a constant
force in the earth frame and a yaw moment. Axes are north-east-down, the body's front-right-down.
"""

from math import cos, degrees, radians, sin

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

SUBSTEPS = 10
PARAMETERS = {
    "mass": 110.0,
    "inertia": 15.0,
    "drag": 60.0,
    "yaw_drag": 20.0,
    "push_north": 0.0,
    "push_east": 0.0,
    "push_down": 0.0,
    "start_north": 0.0,
    "start_east": 0.0,
    "start_depth": 0.0,
    "start_heading": 0.0,
}


class ForeignRov(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.pose = [0.0] * 4
        self.rates = [0.0] * 4
        for name in ("surge", "sway", "heave", "yaw"):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name, value in PARAMETERS.items():
            setattr(self, name, value)
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        outputs = {
            "north": lambda: self.pose[0],
            "east": lambda: self.pose[1],
            "depth": lambda: self.pose[2],
            "heading": lambda: degrees(self.pose[3]) % 360.0,
        }
        for name, getter in outputs.items():
            self.register_variable(Real(name, causality=Fmi2Causality.output, getter=getter))

    def exit_initialization_mode(self):
        self.pose = [self.start_north, self.start_east, self.start_depth, radians(self.start_heading)]

    def do_step(self, current_time, step_size):
        h = step_size / SUBSTEPS
        for _ in range(SUBSTEPS):
            u, v, w, r = self.rates
            c, s = cos(self.pose[3]), sin(self.pose[3])
            along, across = c * self.push_north + s * self.push_east, c * self.push_east - s * self.push_north
            accelerations = (
                (self.surge + along - self.drag * u) / self.mass + r * v,
                (self.sway + across - self.drag * v) / self.mass - r * u,
                (self.heave + self.push_down - self.drag * w) / self.mass,
                (self.yaw - self.yaw_drag * r) / self.inertia,
            )
            u, v, w, r = self.rates = [old + h * a for old, a in zip(self.rates, accelerations, strict=True)]
            moved = (c * u - s * v, s * u + c * v, w, r)
            self.pose = [old + h * rate for old, rate in zip(self.pose, moved, strict=True)]
        return True
