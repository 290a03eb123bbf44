"""A claim of the paper beside what is measured here, and how lengths are told."""

from dataclasses import dataclass

import numpy as np

from .experiment import Experiment, Series

CONFIRMED, IN_PART, CHOSEN, NOT = "confirmed", "in part", "chosen to agree", "not confirmed"
"""Verdicts. What was chosen to agree is no evidence: the paper does not tell a value, and one that fits was taken."""

ABOUT = 0.2
"""How far from a number, as a share of it, is still about it."""


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, where it stands, what is measured here, a verdict, and a command that repeats it."""

    paper_says: str
    where: str
    measured: str
    verdict: str
    command: str


def is_about(value: float, told: float) -> bool:
    """Tell whether a value is about one that the paper tells."""
    return bool(abs(value - told) <= ABOUT * told)


def largest(run: Experiment) -> float:
    """Return the largest mean error in the hold of x, y and z, in m."""
    return float(np.abs(run.held.mean(axis=0)[:3]).max())


def mean(run: Experiment) -> str:
    """Return the mean error of the hold: the largest of x, y and z, and yaw."""
    return f"{1e3 * largest(run):.1f} mm and {np.degrees(abs(run.held.mean(axis=0)[5])):.2f} deg"


def mm(length: float | None) -> str:
    """Return a length in mm."""
    return f"{1e3 * (length or 0.0):.2f} mm"


def mms(lengths: Series) -> str:
    """Return lengths in mm."""
    return f"{', '.join(f'{1e3 * x:.1f}' for x in lengths)} mm"
