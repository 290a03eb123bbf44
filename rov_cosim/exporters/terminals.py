"""Signals of this project's loop that tools of FMI 3.0 connect at once: its terminals."""

TERMINALS = {
    "pose": ("eta",),
    "velocity": ("nu",),
    "measured_pose": ("eta_m", "eta_m_valid"),
    "set_point": ("eta_d", "eta_dot_d"),
    "thrusters": ("u",),
    "wrench": ("tau",),
    "arm": ("F_arm",),
    "surroundings": ("current", "F_umbilical", "thrust_loss"),
}
"""Keys of inputs and outputs that go together between components; a component with all of them has the terminal."""

TAKEN_FOR = {"nu_m": "nu"}
"""The key under which a terminal has a signal, where that is not its own."""
