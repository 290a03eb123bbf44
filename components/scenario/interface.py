"""Interface of the scenario. All is neutral by default: still water, no pull, the set-point handed on."""

from ..interface import POSE, POSE_UNITS, SAMPLE_TIME, VELOCITY_UNITS, XYZ, Sampled, Signal, count, indexed, vector
from ..vehicle import N_THRUSTERS, THRUSTERS
from . import equations

_PULLS = count(2)

COMPONENT = Sampled(
    name="scenario",
    title="Scenario: current, umbilical, set-point over time",
    description="What happens around a vehicle over time: current, pulls of the umbilical, steps and motion of the "
    "set-point",
    symbol="SCN",
    inputs=(vector("set_point", POSE, "Set-point to which step and motion are added, earth frame", unit=POSE_UNITS),),
    outputs=(
        vector(
            "current",
            XYZ,
            "Velocity of the water, earth frame",
            unit="m/s",
            initially_from=("current_mean", "current_std", "seed"),
        ),
        vector(
            "F_umbilical",
            XYZ,
            "Force of the umbilical on the vehicle, earth frame",
            unit="N",
            initially_from=("pull_F", "pull_begin", "pull_rise", "sample_time"),
        ),
        indexed(
            "thrust_loss",
            N_THRUSTERS,
            "Share of its force that the thruster has lost",
            initially_from=("thrust_loss", "thrust_loss_begin", "sample_time"),
        ),
        vector(
            "eta_d",
            POSE,
            "Set-point in the earth frame",
            unit=POSE_UNITS,
            initially_from=("set_point", "step", "step_begin", "sample_time"),
        ),
        vector(
            "eta_dot_d",
            POSE,
            "Rate of the set-point's sine",
            unit=VELOCITY_UNITS,
            initially_from=("motion", "motion_period"),
        ),
    ),
    parameters=(
        vector("current_mean", XYZ, "Mean velocity of the water, earth frame", unit="m/s"),
        vector("current_std", XYZ, "Standard deviation of the velocity about its mean", unit="m/s", minimum=0.0),
        Signal(
            "current_correlation_time",
            "Correlation time of the velocity; 0: white",
            unit="s",
            start=60.0,
            minimum=0.0,
        ),
        Signal(
            "pull_F",
            "Force of the pull on the vehicle, earth frame",
            pattern="pull[{}].F.{}",
            axes=(_PULLS, XYZ),
            unit="N",
        ),
        Signal("pull_begin", "When the pull begins", pattern="pull[{}].begin", axes=(_PULLS,), unit="s", minimum=0.0),
        Signal(
            "pull_duration",
            "How long the pull lasts; 0: to the end",
            pattern="pull[{}].duration",
            axes=(_PULLS,),
            unit="s",
            minimum=0.0,
        ),
        Signal(
            "pull_rise",
            "Time in which the pull grows to its force; 0: at once",
            pattern="pull[{}].rise",
            axes=(_PULLS,),
            unit="s",
            minimum=0.0,
        ),
        Signal(
            "thrust_loss",
            "Share of its force that the thruster loses; 1: dead, 2: reversed",
            pattern="thruster[{}].loss",
            axes=(THRUSTERS,),
        ),
        Signal("thrust_loss_begin", "When the thrusters fail", unit="s", minimum=0.0),
        vector("step", POSE, "Step of the set-point", unit=POSE_UNITS),
        Signal("step_begin", "When the set-point steps", unit="s", minimum=0.0),
        vector("motion", POSE, "Amplitude of the set-point's sine", unit=POSE_UNITS),
        Signal("motion_period", "Period of the set-point's sine", unit="s", start=60.0, minimum=1e-3),
        Signal(
            "seed",
            "Selects the variation of the current; another than the arm's, which draws from the same source",
            type="Integer",
            start=1001,
            minimum=0,
        ),
        Signal("sample_time", "Time between samples", unit="s", start=SAMPLE_TIME, minimum=1e-6),
    ),
    states=(
        Signal("samples", "Number of samples taken"),
        vector("variation", XYZ, "Velocity of the water about its mean"),
    ),
    initial_state=equations.initial_state,
    sample=equations.sample,
    draws=3,
    seed="seed",
)
