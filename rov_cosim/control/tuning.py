"""Gains of a controller from the vehicle's inertia and from what delays its loop: one rule, no trials.

The lag of the loop is L = (n + 1/2) T + T_f + tau: n samples T of delay and the hold, the lead filter, the thrusters.
The bandwidth follows from it, omega = 0.2 / L, and from the bandwidth the gains of an axis of inertia M:

    K_P + W Gamma W^T = M omega^2,    K_D = 2 zeta M omega,    epsilon_0 W Gamma W^T = (omega / 10) M omega^2

Near the set-point the adaptive law is a PID with these three gains: its estimate is the integral of the rate, which
stiffens, and of the error. A controller that integrates the error alone has K_P and K_I in the place of the first and
the third.

In yaw a current takes K_s of the stiffness (`softening`), and at least half of the rule's is to be left. What is
wanting is added to K_P, and K_D follows the bandwidth that the yaw has then, up to twice omega:

    K_P + W Gamma W^T = M omega_psi^2,    K_D = 2 zeta M omega_psi,    omega_psi^2 = max(omega^2, K_s / M + omega^2 / 2)

The rule needs of a controller's component only what it declares: K_P and K_D, and K_I, or Gamma and epsilon_0 with a
state theta_hat. W is read off its own output `disturbance`, whatever columns it has.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..components.interface import SAMPLE_TIME, Sampled
from ..components.vehicle import degrees_of_freedom
from ..errors import UserError

LOOP_STEPS = 2
"""Samples of delay of the loop itself: e(t_k) = eta(t_(k-2)), by the two connections from the vehicle by the arm."""

ADAPTED_SHARE = 0.2
"""W Gamma W^T as a share of M omega^2, which is that of the paper's gains; the rest of the stiffness is K_P."""

INTEGRAL_SHARE = 0.1
"""The integral gain over the stiffness, as a share of omega (Fossen 2011, section 12.2)."""

MOST_IN_YAW = 2.0
"""The bandwidth of yaw against a current over omega, at most: the lag leaves 30 deg of phase then."""

LEFT_IN_CURRENT = 0.5
"""Of the stiffness in yaw, what a current has to leave; an integral needs M K_I / K_D of it (Hurwitz), 0.07 to 0.22."""

DIGITS = 4
"""Significant digits of a gain."""


class TuningError(UserError):
    """There are no gains by the rule; the message says why."""


@dataclass(frozen=True)
class Timing:
    """What delays a loop.

    Parameters
    ----------
    sample_time, filter_time_constant, thruster_time_constant : in s.
    delay : samples by which the measurement is late.
    """

    sample_time: float = SAMPLE_TIME
    filter_time_constant: float = 0.1
    thruster_time_constant: float = 0.0
    delay: float = 0.0

    @property
    def lag(self) -> float:
        """L, the sum of all delays and lags, in s."""
        hold = (LOOP_STEPS + self.delay + 0.5) * self.sample_time
        return hold + self.filter_time_constant + self.thruster_time_constant


@dataclass(frozen=True)
class Rule:
    """The figures of the rule.

    Parameters
    ----------
    bandwidth : omega L.
    damping : the damping ratio zeta.
    integral : the integral gain over omega and the stiffness.
    adapted : W Gamma W^T over the stiffness; the larger, the smaller is epsilon_0 for the same integral gain.
    current : speed in m/s of a current in which the yaw keeps enough of its stiffness.
    """

    bandwidth: float = 0.2
    damping: float = 0.7
    integral: float = INTEGRAL_SHARE
    adapted: float = ADAPTED_SHARE
    current: float = 0.25

    def omega(self, timing: Timing) -> float:
        """Return the bandwidth in rad/s."""
        return self.bandwidth / timing.lag


def tuned(
    component: Sampled,
    inertia: ArrayLike,
    parameters: Mapping[str, Any] | None = None,
    timing: Timing | None = None,
    rule: Rule | None = None,
) -> dict[str, float]:
    """Return the gains of a controller by the names of its parameters.

    Parameters
    ----------
    component : the controller.
    inertia : of the vehicle with its added mass, by axis of the body, shape (6,), in kg and kg m^2.
    parameters : the controller's parameters that are not the declared ones, by name: points of attack and the like.
    timing, rule : the declared ones if left out.

    Raises
    ------
    TuningError : the controller has no such gains, or the loop is too quick for its adaptation.
    """
    keys = {signal.key for signal in component.parameters}
    if not {"K_P", "K_D"} <= keys:
        raise TuningError(f"{component.name} has no gains K_P and K_D: the rule is for controllers that have.")
    M, rule = earth_inertia(inertia), rule or Rule()
    omega = rule.omega(timing or Timing())
    gains: dict[str, NDArray[np.float64]] = {"K_D": 2 * rule.damping * M * omega}
    stiffness = M * omega**2
    if "K_I" in keys:
        gains["K_I"] = rule.integral * omega * stiffness
    if {"Gamma", "epsilon_0"} <= keys:
        most = next(float(np.max(s.maximum)) for s in component.parameters if s.key == "epsilon_0")
        epsilon = min(rule.integral * omega / rule.adapted, most)
        W, controlled = estimate_map(component, parameters or {})
        W = W * controlled[:, None]
        gains["Gamma"] = rule.integral * omega / epsilon * _gamma(W, stiffness)
        gains["epsilon_0"] = np.array([epsilon])
        stiffness = stiffness - W**2 @ gains["Gamma"]
        if not np.all(stiffness > 0):
            raise TuningError(
                f"A bandwidth of {omega:.3g} rad/s and an integral gain of {rule.integral:g} leave no K_P beside what "
                f"{component.name} adapts, {rule.integral * omega / epsilon:.3g} of the stiffness: take less of either."
            )
    gains["K_P"] = stiffness
    return {
        name: float(f"{value:.{DIGITS}g}")
        for signal in component.parameters
        if signal.key in gains
        for name, value in zip(signal.names, gains[signal.key].tolist(), strict=True)
    }


def stiffened(gains: Mapping[str, float], softening: float, inertia: float, omega: float) -> dict[str, float]:
    """Return gains that make up in yaw for what a current takes of the stiffness.

    Parameters
    ----------
    gains : by the rule, by name.
    softening : K_s in N m/rad.
    inertia : M of yaw in kg m^2.
    omega : the bandwidth in rad/s.
    """
    stiffness = inertia * omega**2
    added = np.clip(softening - (1 - LEFT_IN_CURRENT) * stiffness, 0.0, (MOST_IN_YAW**2 - 1) * stiffness)
    changed = {
        "K_P.psi": gains["K_P.psi"] + added,
        "K_D.psi": gains["K_D.psi"] * np.sqrt(1 + added / stiffness),
    }
    return {**gains, **{name: float(f"{value:.{DIGITS}g}") for name, value in changed.items()}}


def earth_inertia(inertia: ArrayLike) -> NDArray[np.float64]:
    """Return the inertia by axis of the pose, shape (6,): surge and sway turn into each other and share their mean."""
    M = np.array(inertia, dtype=float)
    M[:2] = M[:2].mean()
    return M


def estimate_map(component: Sampled, parameters: Mapping[str, Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return W, shape (6, n), and which axes are controlled, shape (6,), of a controller that is level.

    W is how the estimated body wrench follows the state theta_hat, by the controller's own output.

    Raises
    ------
    TuningError : the parameters do not meet what the component requires.
    """
    values = {**dict(zip(component.p.names, component.p.start.tolist(), strict=True)), **parameters}
    p = component.p.unpack(np.array([float(values[name]) for name in component.p.names]))
    if unmet := component.unmet(p):
        raise TuningError(" ".join(unmet))
    u = component.u.unpack(component.u.start.copy())
    u.eta_m_valid = 1.0

    def disturbance(theta_hat: Any) -> NDArray[np.float64]:
        x = component.x.unpack(np.asarray(component.x.pack(component.initial_state(p)), dtype=float))
        x.theta_hat = theta_hat
        return np.asarray(component.sample(x, u, p, np.zeros(component.draws))[1]["disturbance"], dtype=float)

    n = next(signal.size for signal in component.states if signal.key == "theta_hat")
    none = disturbance(np.zeros(n))
    W = np.stack([disturbance(unit) - none for unit in np.eye(n)], axis=1)
    return W, np.asarray(degrees_of_freedom(p.control_roll_pitch), dtype=float)


def _gamma(W: Any, M: Any) -> NDArray[np.float64]:
    """Return Gamma, shape (n,), whose W Gamma W^T has the diagonal M in each translation, and at most M in rotation.

    Forces share an axis by the inertia that each feels at its point of attack, 1 / (W_i^T M^-1 W_i): a long lever has
    little, so that it does not stiffen the rotation beyond M. Couples, columns without a force, make up for what the
    levers leave.
    """
    is_force = np.any(np.abs(W[:3]) > 0, axis=0)
    felt = 1 / np.maximum(np.sum(W**2 / M[:, None], axis=0), np.finfo(float).tiny)
    axis = np.where(is_force, np.argmax(np.abs(W[:3]), axis=0), 3 + np.argmax(np.abs(W[3:]), axis=0))
    gamma = np.zeros(W.shape[1])
    for a in range(6):
        share = felt * (axis == a) * np.any(np.abs(W) > 0, axis=0)
        reached = W**2 @ share
        if reached[a] > 0:
            left = M - W**2 @ gamma if a >= 3 else M
            gamma += share * np.min(np.maximum(left, 0)[reached > 0] / reached[reached > 0])
    return gamma
