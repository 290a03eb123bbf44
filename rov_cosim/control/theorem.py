"""The theorem of Hoang & Kreuzer 2007, section 3, for any gains: its conditions as published, corrected and sharpened.

With the error e, the velocity eta', symmetric K_P, K_D and Gamma, and epsilon = epsilon_0 / (1 + alpha |e|),

    V = 1/2 eta'^T M eta' + 1/2 e^T K_P e + epsilon e^T M eta' + 1/2 (th - theta)^T Gamma^-1 (th - theta)

falls along every motion if the conditions hold, whatever the unknown forces are. They are for four degrees of freedom,
with roll and pitch at zero. `rov_cosim/control/README.md` has the derivation.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyroots, polytrim, polyval
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

AXES = (0, 1, 2, 5)
"""Surge, sway, heave and yaw among the six axes."""

_TURN = np.zeros((4, 4))
_TURN[[0, 1], [1, 0]] = -1.0, 1.0

_STARTS, _ITERATIONS = 200, 200

_COUPLED = 1e-6
"""Part of a gain by which others differ from it, or couple axes; less is the rounding of one that was measured."""


class Case(NamedTuple):
    """What the theorem is about; four degrees of freedom.

    Parameters
    ----------
    M : inertia in body axes with its added mass, shape (4, 4).
    K_P, K_D : symmetric, shape (4, 4), in earth axes.
    epsilon_0, alpha : of the adaptation.
    D_linear, D_quadratic : the vehicle's own damping, shape (4,), in body axes.
    speed : up to which (6) and (7) count it, in m/s and rad/s; they have no bound else.
    """

    M: Matrix
    K_P: Matrix
    K_D: Matrix
    epsilon_0: float
    alpha: float
    D_linear: Vector
    D_quadratic: Vector
    speed: float = 1.0

    @property
    def undamped(self) -> "Case":
        """The same without the vehicle's own damping, as the paper takes it."""
        return self._replace(D_linear=np.zeros(4), D_quadratic=np.zeros(4))

    @property
    def d_most(self) -> float:
        """The largest damping at the speed."""
        return float(np.max(self.D_linear + self.speed * self.D_quadratic))


class Condition(NamedTuple):
    """A condition: its name, its left-hand side, which is to be positive, and the largest epsilon_0 that meets it.

    largest is 0 if none does, NaN where it does not depend on epsilon_0.
    """

    name: str
    margin: float
    largest: float

    @property
    def holds(self) -> bool:
        """Tell whether it is met."""
        return self.margin > 0


def conditions(case: Case) -> list[Condition]:
    """Return all conditions, the sharpest last."""
    return [published(case), corrected(case), seven(case), positive(case), sharp(case)]


def published(case: Case) -> Condition:
    """Return (6) as published, with the Coriolis constant that its proof needs."""
    return _six(case, "(6) as published", -np.linalg.eigvalsh(case.M)[0] / 4)


def corrected(case: Case) -> Condition:
    """Return (6) with the sign and the eigenvalue that (A.6) allows: -(epsilon_0 / 4) m_M."""
    return _six(case, "(6) corrected", np.linalg.eigvalsh(case.M)[-1] / 4)


def seven(case: Case) -> Condition:
    """Return (7)."""
    least, most = np.linalg.eigvalsh(case.K_P)[0], np.linalg.eigvalsh(case.K_D)[-1]
    return Condition("(7)", float(least - (most + case.d_most) / 2), np.nan)


def positive(case: Case) -> Condition:
    """Return that V is positive definite: K_P,i > epsilon_0^2 times the inertia of the axis."""
    m, _ = _inertia(case)
    m = _in_body(m, max)  # of any heading
    margin = np.linalg.eigvalsh(case.K_P - case.epsilon_0**2 * np.diag(m))[0]
    largest = np.linalg.eigvalsh(case.K_P / np.sqrt(np.outer(m, m)))[0]
    return Condition("P positive definite", float(margin), float(np.sqrt(max(largest, 0.0))))


def sharp(case: Case) -> Condition:
    """Return the bound by axes: the smallest coefficient of the squared speeds in -V', over all errors and speeds.

    With t = alpha |e| / (1 + alpha |e|), k the controller's damping of an axis and d the vehicle's,

        k + d - epsilon_0 [(1 - t) (m + (k + d)^2 / (4 K_P)) + t (1 - t) kappa m + t n / (2 alpha)]

    is concave in d: the worst d is at an end. d counts up to the speed (epsilon_0 / alpha) t alone: above it, it takes
    more than it gives. So at either end this is a cubic in t.
    """
    largest = case.epsilon_0 if (margin := _by_axes(case)) > 0 else 0.0
    above = next(
        (x for x in np.geomspace(1e-3, 1e2, 120) if x > largest and _by_axes(case._replace(epsilon_0=x)) <= 0), np.inf
    )
    for _ in range(50 if np.isfinite(above) else 0):
        middle = (largest + above) / 2
        largest, above = (middle, above) if _by_axes(case._replace(epsilon_0=middle)) > 0 else (largest, middle)
    return Condition("by axes", margin, float(largest))


def _by_axes(case: Case) -> float:
    m, n = _inertia(case)
    low, *_, high = np.linalg.eigvalsh(case.M)
    kappa = ((low + high) / (2 * np.sqrt(low * high)) - 1) / 2
    if case.alpha == 0 and (n.any() or case.D_quadratic.any()):
        return -np.inf  # these terms grow with the error
    error = 1 / case.alpha if case.alpha > 0 else 0.0
    damping = case.D_linear, case.epsilon_0 * error * case.D_quadratic
    least, most, K_P = _in_body(_least_of(case.K_D), min), _in_body(_most_of(case.K_D), max), _least_of(case.K_P)
    if K_P.min() <= 0:
        return -np.inf  # the axes are coupled by more than sums of rows can bound
    # Where gains and damping have not the same axes, each takes a share of e^T K_P e for the product with e.
    alike, most_damping = _turns_alike(case.K_P) and _turns_alike(case.K_D), _in_body(damping[0] + damping[1], max)
    share = np.ones(4) if alike else most / (most + most_damping)
    cross = _in_body(_most_of(case.K_D @ np.diag(1 / (share * K_P)) @ case.K_D), max)
    K_P = _in_body(K_P, min)
    rest = K_P if alike else np.where(share < 1, (1 - share) * K_P, np.inf)
    margins = []
    for d, per_t in ((np.zeros(4), np.zeros(4)), damping):  # the damping d + per_t t
        both = most + d if alike else d
        squared = cross + (both**2 - (most**2 if alike else 0)) / rest
        near = np.stack([m + squared / 4, both * per_t / (2 * rest), per_t**2 / (4 * rest)])  # of 1, t, t^2
        bracket = np.zeros((4, 4))
        bracket[:3] += near
        bracket[1:] -= near
        bracket[1] += kappa * m + error * n / 2
        bracket[2] -= kappa * m
        margins += [_least(a) for a in (np.stack([least + d, per_t, 0 * d, 0 * d]) - case.epsilon_0 * bracket).T]
    return float(min(margins))


def coriolis_constant(M: Matrix) -> float:
    """Return k_c with |C(eta, x) y| <= k_c |x| |y| (property P5) for the Christoffel form of C.

    M turns with yaw alone, dM/dpsi = R N R^T with N = S M - M S: 2 C(x) y = x_psi N y + y_psi N x - e_psi x^T N y.
    It is bilinear and symmetric: the best y for an x is a singular vector, taken in turns from many starts. For a
    diagonal M it is |m_x - m_y| / sqrt(3).
    """
    N = _TURN @ M - M @ _TURN
    psi = np.eye(4)[3]
    x, size = np.random.default_rng(1).normal(size=(_STARTS, 4)), np.zeros(_STARTS)
    for _ in range(_ITERATIONS):
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        turned = x @ N  # N is symmetric
        form = (x[:, 3, None, None] * N + turned[:, :, None] * psi - psi[:, None] * turned[:, None, :]) / 2
        _, sizes, rows = np.linalg.svd(form)
        x, size, before = rows[:, 0], sizes[:, 0], size
        if np.all(size - before < 1e-12):
            break
    return float(size.max())


def failures(found: Sequence[Condition], epsilon_0: float) -> list[str]:
    """Return in words what fails, and what would cure it."""
    said = []
    for one in found:
        if one.holds:
            continue
        if np.isneginf(one.margin):
            said.append(f"{one.name} has no bound: alpha is 0, or the gains couple the axes too much.")
            continue
        cure = f"epsilon_0 below {one.largest:.3g} meets it" if one.largest > 0 else "no epsilon_0 meets it"
        if np.isnan(one.largest):
            cure = "it wants every K_P above half of the largest K_D"
        said.append(f"{one.name} fails by {-one.margin:.3g} at epsilon_0 {epsilon_0:.3g}; {cure}.")
    return said


def _six(case: Case, name: str, fourth: float) -> Condition:
    m = np.linalg.eigvalsh(case.M)[-1]
    k_c = coriolis_constant(case.M)
    coriolis = k_c / case.alpha if case.alpha > 0 else np.inf if k_c > 0 else 0.0
    K_D = np.linalg.eigvalsh(case.K_D)
    per_epsilon = fourth + coriolis + m + K_D[-1] / 2 + case.d_most / 2
    left = K_D[0] + case.D_linear.min()
    return Condition(name, float(left - case.epsilon_0 * per_epsilon), float(left / per_epsilon))


def _inertia(case: Case) -> tuple[Vector, Vector]:
    """Return bounds by axis of eta'^T M eta', and of eta'^T (dM/dpsi) eta': sums of rows (Gershgorin)."""
    N = _TURN @ case.M - case.M @ _TURN
    return np.abs(case.M).sum(axis=1), np.abs(N).sum(axis=1)


def _in_body(gain: Vector, bound: Callable[[Iterable[float]], float]) -> Vector:
    """Return the bound of an earth-frame gain in body axes: surge and sway may each have either of x and y."""
    pair = float(bound(gain[:2].tolist()))
    return np.array([pair, pair, gain[2], gain[3]])


def _least_of(gain: Matrix) -> Vector:
    """Return the diagonal of a matrix that is nowhere above the gain: less the sums of rows (Gershgorin)."""
    least: Vector = 2 * np.diag(gain) - np.abs(gain).sum(axis=1)
    return least


def _most_of(gain: Matrix) -> Vector:
    """Return the diagonal of a matrix that is nowhere below the gain."""
    most: Vector = np.abs(gain).sum(axis=1)
    return most


def _is_diagonal(gain: Matrix) -> bool:
    return bool(np.abs(gain - np.diag(np.diag(gain))).max() <= _COUPLED * np.abs(gain).max())


def _turns_alike(gain: Matrix) -> bool:
    """Tell whether a gain is the same in whatever direction the vehicle heads."""
    return _is_diagonal(gain) and bool(abs(gain[0, 0] - gain[1, 1]) <= _COUPLED * gain[0, 0])


def _least(a: Vector) -> float:
    """Return the smallest value for t in [0, 1] of a polynomial of coefficients a, that of 1 first."""
    turns = polyroots(polyder(polytrim(a))) if np.any(a[1:]) else np.zeros(0)
    inside = turns[np.isreal(turns)].real
    return float(np.min(polyval(np.r_[0.0, 1.0, inside[(inside > 0) & (inside < 1)]], a)))
