"""A component on the bench: one instance, its values by name."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np

from rov_cosim.components.instance import Instance
from rov_cosim.components.interface import Component, Layout

RELAXED: dict[str, dict[str, float]] = {
    "rov_plant": {"lock_roll_pitch": False, "thrust_max": 30.0, "thruster_time_constant": 0.2, "r_G.x": 0.01},
    "passive_arm": {
        **{"noise_std_angle": 0.01, "noise_correlation_time": 0.5, "stiffness": 3.0, "preload.z": 1.0},
        **{"delay": 2, "dropout": 0.1},
    },
    "taut_wire": {
        **{"noise_correlation_time": 0.5, "attitude_drift_time": 1.0, "wire_bias.azimuth": 0.02},
        **{"delay": 2, "dropout": 0.1, "winch_rate": 2.0},
    },
    "adaptive_pd": {
        **{"eta_m_valid": True, "control_roll_pitch": True, "thrust_max": 8.0, "r_G.x": 0.01, "bridging": 0.1},
        **{"adapt_by_pose": True, "projection": True, "Gamma.M.x": 2.0, "Gamma.M.z": 3.0},
    },
    "pid": {"eta_m_valid": True, "control_roll_pitch": True, "thrust_max": 8.0, "r_G.x": 0.01, "bridging": 0.1},
    "sliding_mode": {"eta_m_valid": True, "control_roll_pitch": True, "thrust_max": 8.0, "r_G.x": 0.01},
    "sun_cheah": {"eta_m_valid": True, "control_roll_pitch": True, "thrust_max": 8.0, "r_G.x": 0.01},
    "scenario": {
        **{"current_mean.x": 0.2, "current_std.y": 0.1, "pull[1].F.x": 5.0, "pull[1].begin": 0.1, "pull[2].F.z": -2.0},
        **{"step.x": 0.3, "step_begin": 0.2, "motion.y": 0.2, "pull[1].rise": 0.3},
        **{"thruster[2].loss": 0.5, "thrust_loss_begin": 0.2},
    },
}
"""Settings that put every term of the equations to work."""


class Rig:
    """An instance with values set and read by name or by group of names."""

    def __init__(self, component: Component, values: Mapping[str, float] | None = None) -> None:
        self.warnings: list[str] = []
        self.component = component
        self.instance = Instance(component, self.warnings.append)
        names = component.u.names + component.y.names + component.p.names
        self.index = {name: i for i, name in enumerate(names)}
        self.set(values or {})

    def set(self, values: Mapping[str, float]) -> None:
        self.instance.set([self.index[name] for name in values], list(values.values()))

    def put(self, group: str, values) -> None:
        """Set all variables of a group, for example ``eta``."""
        self.instance.set(self.members(group), np.ravel(values).tolist())

    def get(self, group: str):
        """Return the values of a group as an array, of a single variable as a number."""
        if group in self.index:
            return self.instance.get([self.index[group]])[0]
        return np.array(self.instance.get(self.members(group)))

    def outputs(self) -> list[float]:
        """Return all outputs."""
        return self.instance.get([self.index[name] for name in self.component.y.names])

    def members(self, group: str) -> list[int]:
        return [i for name, i in self.index.items() if name.startswith((f"{group}.", f"{group}["))]

    def parameters(self) -> SimpleNamespace:
        """Return the parameters as the equations see them."""
        values = self.instance.get([self.index[name] for name in self.component.p.names])
        return self.component.p.unpack(np.array(values))

    def start(self, time: float = 0.0) -> "Rig":
        self.instance.set_times(time)
        self.instance.enter_initialization()
        self.instance.exit_initialization()
        return self

    def step(self, h: float = 0.03) -> None:
        self.instance.do_step(self.instance.time, h)

    def run(self, duration: float, h: float = 0.03) -> None:
        for _ in range(round(duration / h)):
            self.step(h)


def parameters(component: Component, **values) -> SimpleNamespace:
    """Return the parameter namespace that the equations see, with some values by key."""
    return _changed(component.p, values)


def inputs(component: Component, **values) -> SimpleNamespace:
    """Return the input namespace that the equations see, with some values by key."""
    return _changed(component.u, values)


def _changed(layout: Layout, values: Mapping[str, object]) -> SimpleNamespace:
    namespace = layout.unpack(layout.start.copy())
    for key, value in values.items():
        assert hasattr(namespace, key), key
        setattr(namespace, key, np.asarray(value, dtype=float) if np.ndim(value) else float(value))
    return namespace


def random_inputs(component, random):
    """Return a value for each input: poses near the structure, forces of some newtons, switches mostly as they are."""
    values = {}
    for signal in component.inputs:
        for name in signal.names:
            usual = name == "eta_m_valid"
            if signal.type == "Boolean":
                values[name] = usual if random.random() > 0.05 else not usual
            else:
                values[name] = random.normal(scale=3.0 if signal.unit == "N" else 0.2)
    return values
