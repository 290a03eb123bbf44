"""Interface of the passive arm; link lengths, encoders and error after Hoang & Kreuzer 2007, section 4.2."""

from .. import sensing
from ..interface import POSE, POSE_UNITS, XYZ, Notice, Sampled, Signal, indexed, switch, vector
from ..vehicle import R_A
from . import equations

_REACH = ("eta", "r_A", "attachment")
_ATTACHED = (*_REACH, "L")

COMPONENT = Sampled(
    name="passive_arm",
    title="Passive six-joint measuring arm",
    description="Passive arm that measures the pose of a vehicle relative to a structure by forward kinematics",
    symbol="ARM",
    inputs=(sensing.TRUE_POSE,),
    outputs=(
        *sensing.measurement(_ATTACHED, ("encoder_counts", "noise_std", "noise_std_angle", "bias")),
        switch("attached", "Whether the arm is attached to the structure", initially_from=_ATTACHED),
        indexed(
            "q", 6, "Joint angle as the encoder reads it", unit="rad", initially_from=(*_ATTACHED, "encoder_counts")
        ),
        Signal("reach", "Distance from the shoulder to the attachment", unit="m", minimum=0.0, initially_from=_REACH),
        vector(
            "F_arm",
            XYZ,
            "Force of the arm on the vehicle at r_A, earth frame",
            unit="N",
            initially_from=(*_ATTACHED, "stiffness", "preload"),
        ),
    ),
    parameters=(
        indexed("L", 2, "Length of the link", unit="m", start=0.7, minimum=1e-3),
        R_A,
        vector(
            "attachment",
            POSE,
            "Where and how the end effector sits on the structure, earth frame",
            unit=POSE_UNITS,
            start=[0.7, 0.5, 0.4, 0.0, 0.0, 0.0],
        ),
        Signal("encoder_counts", "Counts a turn of the encoders; 0: ideal", type="Integer", start=4096, minimum=0),
        Signal("noise_std", "Standard deviation of the position noise of an axis", unit="m", start=0.005, minimum=0.0),
        Signal("noise_std_angle", "Standard deviation of the noise of an angle", unit="rad", start=0.0, minimum=0.0),
        Signal("noise_correlation_time", "Correlation time of the noise; 0: white", unit="s", start=0.0, minimum=0.0),
        vector("bias", XYZ, "Constant error of the measured position", unit="m"),
        *sensing.PARAMETERS,
        Signal("stiffness", "Stiffness of the arm's pull towards the attachment", unit="N/m", start=0.0, minimum=0.0),
        vector("preload", XYZ, "Constant part of the arm's pull, earth frame", unit="N"),
    ),
    states=(
        *sensing.STATES,
        indexed("q", 6, "Last valid joint angles"),
        vector("noise", POSE, "Noise of the last sample"),
        Signal("started", "Whether a sample has been taken"),
    ),
    initial_state=equations.initial_state,
    sample=equations.sample,
    draws=8,
    seed="seed",
    notices=(
        Notice(
            "attached",
            0.0,
            "The arm is detached: the attachment is out of reach or the pitch angle near pi/2. eta_m holds meanwhile; "
            "check attachment.*, L[*] and r_A.*.",
        ),
    ),
)
