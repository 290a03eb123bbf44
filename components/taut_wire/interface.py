"""Interface of the taut wire; ports as those of the passive arm, whose place it takes."""

import numpy as np

from .. import sensing
from ..interface import XYZ, Notice, Requirement, Sampled, Signal, switch, vector
from ..vehicle import R_A
from . import equations

_REACH = ("eta", "r_A", "attachment")
_LIMITS = (*_REACH, "length_min", "length_max", "azimuth_max", "elevation_max")
_WINCH = (*_REACH, "length_max", "winch_tension", "winch_stiffness", "winch_rate", "sample_time")
_NOISE = ("noise_correlation_time", "seed")
_WIRE = ("length_resolution", "encoder_counts", "length_noise_std", "angle_noise_std", "wire_bias", *_NOISE)
_ATTITUDE = ("attitude_resolution", "attitude_noise_std", "attitude_drift_std", "attitude_drift_time", "attitude_bias")
_WIRE_AXES, _WIRE_UNITS = ("length", "azimuth", "elevation"), ("m", "rad", "rad")
_ANGLES = ("phi", "theta", "psi")
_TENTH = np.radians(0.1)

COMPONENT = Sampled(
    name="taut_wire",
    title="Taut wire with compass and inclinometers",
    description="Taut wire that measures the pose of a vehicle by length, two angles, compass and inclinometers",
    symbol="TW",
    inputs=(sensing.TRUE_POSE,),
    outputs=(
        *sensing.measurement(
            (*_LIMITS, "winch_tension", "winch_stiffness", "winch_rate", "sample_time", "slack_tension"),
            (*_WIRE[:-1], *_ATTITUDE),
        ),
        switch("attached", "Whether length and angles are within their limits", initially_from=_LIMITS),
        switch("taut", "Whether the wire is taut: a slack one sags", initially_from=(*_WINCH, "slack_tension")),
        vector(
            "wire",
            _WIRE_AXES,
            "Length and body-fixed angles of the wire as they are read",
            unit=_WIRE_UNITS,
            initially_from=(*_REACH, *_WIRE),
        ),
        vector(
            "attitude",
            _ANGLES,
            "Roll and pitch of the inclinometers, heading of the compass",
            unit="rad",
            initially_from=("eta", *_ATTITUDE, *_NOISE),
        ),
        Signal("reach", "Distance from the fairlead to the attachment", unit="m", minimum=0.0, initially_from=_REACH),
        Signal("tension", "Tension of the wire", unit="N", minimum=0.0, initially_from=_WINCH),
        vector(
            "F_arm",
            XYZ,
            "Force of the wire on the vehicle at r_A, earth frame",
            unit="N",
            initially_from=_WINCH,
        ),
    ),
    parameters=(
        R_A,
        vector(
            "attachment", XYZ, "Where the wire is fixed to the structure, earth frame", unit="m", start=[0.7, 0.5, 0.4]
        ),
        Signal("length_min", "Least length that is measured (estimate)", unit="m", start=0.1, minimum=1e-3),
        Signal("length_max", "Length of the wire on the drum (estimate)", unit="m", start=3.0, minimum=1e-3),
        Signal(
            "azimuth_max",
            "Largest azimuth of the gimbal, either way",
            unit="rad",
            start=np.pi,
            minimum=0.0,
            maximum=np.pi,
        ),
        Signal(
            "elevation_max",
            "Largest elevation of the gimbal, either way (estimate)",
            unit="rad",
            start=1.4,
            minimum=0.0,
            maximum=1.57,
        ),
        Signal("length_resolution", "Step of the length; 0: ideal", unit="m", start=1e-3, minimum=0.0),
        Signal(
            "encoder_counts", "Counts a turn of the gimbal's encoders; 0: ideal", type="Integer", start=4096, minimum=0
        ),
        Signal(
            "attitude_resolution", "Step of compass and inclinometers; 0: ideal", unit="rad", start=_TENTH, minimum=0.0
        ),
        Signal("length_noise_std", "Standard deviation of the length's noise", unit="m", start=2e-3, minimum=0.0),
        Signal(
            "angle_noise_std",
            "Standard deviation of the noise of the wire's angles",
            unit="rad",
            start=2e-3,
            minimum=0.0,
        ),
        vector(
            "attitude_noise_std",
            _ANGLES,
            "Standard deviation of the noise of inclinometers and compass",
            unit="rad",
            start=[_TENTH, _TENTH, 2 * _TENTH],
            minimum=0.0,
        ),
        Signal("noise_correlation_time", "Correlation time of the noise; 0: white", unit="s", start=0.0, minimum=0.0),
        vector(
            "attitude_drift_std",
            _ANGLES,
            "Standard deviation of the drift of inclinometers and compass",
            unit="rad",
            start=[_TENTH, _TENTH, 2.5 * _TENTH],
            minimum=0.0,
        ),
        Signal("attitude_drift_time", "Correlation time of the drift", unit="s", start=300.0, minimum=1e-3),
        vector("wire_bias", _WIRE_AXES, "Constant error of length and angles", unit=_WIRE_UNITS),
        vector("attitude_bias", _ANGLES, "Constant error of inclinometers and compass", unit="rad"),
        *sensing.PARAMETERS,
        Signal("winch_tension", "Tension that the winch keeps", unit="N", start=8.0, minimum=0.0),
        Signal(
            "winch_stiffness",
            "Stiffness of wire and tensioner beyond the paid-out length",
            unit="N/m",
            start=200.0,
            minimum=1e-3,
        ),
        Signal("winch_rate", "Largest speed of the winch either way", unit="m/s", start=0.5, minimum=0.0),
        Signal("slack_tension", "Tension below which the wire counts as slack", unit="N", start=1.0, minimum=0.0),
    ),
    states=(
        *sensing.STATES,
        vector("noise", (*_WIRE_AXES, *_ANGLES), "Noise of the last sample"),
        vector("drift", _ANGLES, "Drift of the last sample"),
        Signal("paid", "Length of wire that is paid out"),
        Signal("started", "Whether a sample has been taken"),
    ),
    initial_state=equations.initial_state,
    sample=equations.sample,
    draws=11,
    seed="seed",
    requirements=(
        Requirement(
            lambda p: p.length_max - p.length_min,
            "No length of the wire is measured: raise length_max above length_min.",
        ),
        Requirement(
            lambda p: p.winch_tension - p.slack_tension,
            "The winch keeps the wire slack: raise winch_tension above slack_tension.",
        ),
    ),
    notices=(
        Notice(
            "attached",
            0.0,
            "The wire is beyond its limits of length or angle, or the pitch angle is near pi/2. eta_m holds meanwhile; "
            "check attachment.*, length_*, azimuth_max and elevation_max.",
        ),
        Notice(
            "taut",
            0.0,
            "The wire is slack. eta_m holds meanwhile; check winch_rate against the vehicle's speed, winch_tension.",
        ),
    ),
)
