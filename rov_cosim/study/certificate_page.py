"""A certificate in words, one page for the terminal, and several in a table."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ..components.interface import POSE
from ..control.certificate import LEARNED, Certificate
from ..control.lyapunov import BOX, Worst
from ..control.margins import UNSTABLE, Margin, Mode
from ..control.theorem import failures

_NAMES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
_SLOW, _WEAK = 0.2, 0.3
"""Frequency in rad/s below, and damping ratio above which a swing is not told."""

_SHARES = 0.05
"""Part of a direction that is not worth a word."""


def page(certificate: Certificate, worst: Worst | None = None) -> Iterator[str]:
    """Yield the lines of a certificate."""
    loop = certificate.loop
    yield f"{certificate.name}: {loop.law.name}, every {1e3 * loop.step:g} ms"
    yield ""
    yield from loop_lines(certificate)
    yield ""
    yield from work_lines(certificate)
    if certificate.is_adaptive:
        yield ""
        yield from _theorem(certificate, worst)
    else:
        yield "The theorem of the paper is about the adaptive law: nothing is said by it of this controller."


def table(rows: Iterable[Iterable[str]], command: str) -> str:
    """Return a page in Markdown with a row of `cells` for each certificate."""
    lines = [
        "# Certificates",
        "",
        f"Written by `{command}`. Delay and gain are what the level loop has to spare in all axes at once;",
        "[rov_cosim/control/README.md](../rov_cosim/control/README.md) tells what the columns mean.",
        "",
        "| system | delay to spare | gain | slowest mode | sample time up to | roll and pitch | thrust at rest "
        "| its noise | epsilon_0 | (6) published | (6) corrected | by axes |",
        f"|{'---|' * 12}",
    ]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows), ""])


def cells(certificate: Certificate) -> Iterator[str]:
    """Yield the cells of a certificate's row."""
    yield f"`{certificate.name}`"
    margin = certificate.common_margin
    if margin is None:
        yield from ("unstable", "", "", "")
    else:
        slowest = max((mode for mode in certificate.level.modes()), key=lambda mode: mode.time_constant)
        yield f"{1e3 * margin.delay:.0f} ms, {margin.delay / certificate.loop.step:.1f} samples"
        yield _factors(margin)
        yield f"{slowest.time_constant:.3g} s, {_NAMES[POSE.index(slowest.axis)]}"
        yield f"{1e3 * certificate.largest_sample_time:.0f} ms"
    if certificate.tilts:
        tilting = [mode for mode in certificate.linear.modes() if mode.axis in POSE[3:5] and mode.frequency > _SLOW]
        least = min(mode.damping for mode in tilting)
        yield "unstable" if least < 0 else f"damped by {least:.3f}"
    else:
        yield "locked" if certificate.loop.p(certificate.loop.plant).lock_roll_pitch else "controlled"
    limit = f" of {certificate.thrust_max:.4g} N" if np.isfinite(certificate.thrust_max) else ""
    yield f"{certificate.thrust:.3g} N{limit}"
    yield f"{certificate.thrust_noise:.3g} N"
    if not certificate.is_adaptive:
        yield from [""] * 4
        return
    yield f"{certificate.case.epsilon_0:.3g}"
    damped = certificate.conditions[1]
    yield from (f"{condition.largest:.3f}" for condition in (damped[0], damped[1], damped[-1]))


def loop_lines(certificate: Certificate) -> Iterator[str]:
    """Yield gains, modes and margins."""
    level, gains, M = certificate.level, certificate.gains, np.diag(certificate.inertia)
    damping = np.asarray(certificate.loop.p(certificate.loop.plant).D_linear)
    yield f"{'axis':9}{'K_P':>9}{'learned':>9}{'K_I':>9}{'omega':>8}{'zeta':>6}{'slowest':>9}   {_HEAD}"
    yield f"{'':9}{'':>9}{'+':>9}{'/s':>9}{'rad/s':>8}{'':>6}{'s':>9}   {_UNITS}"
    modes = level.modes()
    for axis in level.controlled:
        K, K_D = gains.stiffness[axis, axis], gains.K_D[axis, axis]
        omega = np.sqrt(K / M[axis])
        zeta = (K_D + damping[axis]) / (2 * np.sqrt(K * M[axis])) if K > 0 else np.nan
        slowest = max((abs(mode.time_constant) for mode in modes if mode.axis == POSE[axis]), default=np.nan)
        row = f"{POSE[axis]:9}{gains.K_P[axis, axis]:9.4g}{gains.adapted[axis, axis]:9.3g}{gains.K_I[axis, axis]:9.3g}"
        row += f"{omega:8.2f}{zeta:6.2f}{slowest:9.3g}"
        yield f"{row}   {_margin(certificate.margins.get(axis))}".rstrip()
    if margin := certificate.common_margin:
        yield f"{'all axes':59}   {_margin(margin)}"
        stable = "Stable while the vehicle is level" if certificate.tilts else "Stable"
        yield (
            f"{stable}, with {margin.delay / level.step:.1f} samples of delay to spare; a sample time up to about "
            f"{1e3 * certificate.largest_sample_time:.0f} ms."
        )
    yield from _unstable(modes)
    if certificate.tilts:
        yield "All that is for the controlled axes of a level vehicle. Roll and pitch are free and not controlled:"
        tilting = [mode for mode in certificate.linear.modes() if mode.axis in POSE[3:5] and mode.frequency > _SLOW]
        unstable = list(_unstable(certificate.linear.modes()))
        if unstable:
            unstable.append(
                "That is a warning, for no gain is for roll and pitch: a run tells how far the vehicle swings."
            )
        yield from (f"  {line}" for line in [*unstable, *_swings(tilting)])


def _unstable(modes: Sequence[Mode]) -> Iterator[str]:
    for mode in modes:
        if abs(mode.eigenvalue) > 1 + UNSTABLE:
            yield (
                f"UNSTABLE in the small: {_NAMES[POSE.index(mode.axis)]} grows e-fold in {-mode.time_constant:.3g} s "
                f"at {mode.frequency:.3g} rad/s (eigenvalue {abs(mode.eigenvalue):.5f})."
            )


def _swings(modes: Sequence[Mode]) -> Iterator[str]:
    for mode in modes:
        if 0 < mode.damping < _WEAK:
            name = _NAMES[POSE.index(mode.axis)]
            yield f"{name} swings at {mode.frequency:.2f} rad/s with a damping ratio of {mode.damping:.3f}."


_HEAD = f"{'gain':>17}{'phase':>7}{'delay':>7}"
_UNITS = f"{'times':>17}{'deg':>7}{'ms':>7}"


def _margin(margin: Margin | None) -> str:
    if margin is None:
        return ""
    phase = "" if np.isnan(margin.phase) else f"{np.degrees(margin.phase):.0f}"
    delay = f"{1e3 * margin.delay:.0f}" if np.isfinite(margin.delay) else "any"
    return f"{_factors(margin):>17}{phase:>7}{delay:>7}"


def _factors(margin: Margin) -> str:
    low = f"{margin.gain_down:.2g}" if margin.gain_down else "0"
    return f"{low} to {f'{margin.gain_up:.3g}' if np.isfinite(margin.gain_up) else 'any'}"


def work_lines(certificate: Certificate) -> Iterator[str]:
    """Yield thrust at rest, noise, and what is learned."""
    limit = certificate.thrust_max
    of = f" of {limit:.4g} N" if np.isfinite(limit) else ", without a limit"
    tilt = np.degrees(certificate.pose[3:5])
    tilted = f"; roll {tilt[0]:.1f} deg, pitch {tilt[1]:.1f} deg" if np.abs(tilt).max() > _SHARES else ""
    yield f"Thrust at rest: {certificate.thrust:.3g} N{of}{tilted}."
    if certificate.thrust > limit:
        yield "TOO WEAK: the thrusters cannot hold the vehicle against its loads."
    if np.isfinite(certificate.thrust_noise):
        share = f", {100 * certificate.thrust_noise / limit:.0f} % of the limit" if np.isfinite(limit) else ""
        yield f"Noise moves the noisiest thruster by {certificate.thrust_noise:.3g} N rms{share}."
    if np.isnan(certificate.current_limit):
        yield "The yaw is SOFTER than what its loads turn it by: it may sway in still water."
    elif np.isfinite(certificate.current_limit):
        yield (
            f"Yaw is stiff enough for a current of up to about {certificate.current_limit:.2g} m/s from anywhere; in a "
            f"quicker one it may sway."
        )
    if certificate.is_adaptive:
        yield from _learned(certificate)


def _learned(certificate: Certificate) -> Iterator[str]:
    count, sizes, directions = certificate.learned
    rank = int(np.sum(sizes > LEARNED * sizes[0]))
    yield (
        f"Learned: {count} forces and couples for {len(sizes)} axes, rank {rank}; {count - rank} combinations of them "
        f"cannot be told apart. Weakest: {sizes[rank - 1]:.2g} of {sizes[0]:.2g}."
    )
    for direction in directions[:, rank:].T:
        yield f"CANNOT BE LEARNED: {_in_words(direction, certificate)}."


def _in_words(twist: np.ndarray, certificate: Certificate) -> str:
    """Return the force or moment that no estimated force gives, from the motion in which none of them does work."""
    velocity, turn = twist[:3], twist[3:]
    if np.linalg.norm(turn) < _SHARES:
        return f"the force along {_vector(velocity)}"
    p = certificate.loop.p(certificate.loop.controller)
    line = np.asarray(p.r_C) - np.asarray(p.r_A)
    along = np.linalg.norm(np.cross(line, turn)) < _SHARES * np.linalg.norm(line) * np.linalg.norm(turn)
    where = ", the line from r_A to r_C, about which neither arm nor umbilical has a lever" if along else ""
    return f"the moment about {_vector(turn)}{where}"


def _vector(of: np.ndarray) -> str:
    return f"({' '.join(f'{x:.2f}' for x in of / np.linalg.norm(of) + 0.0)}) in body axes"


def _theorem(certificate: Certificate, worst: Worst | None) -> Iterator[str]:
    case, (undamped, damped) = certificate.case, certificate.conditions
    title = f"Theorem, epsilon_0 {case.epsilon_0:.4g}"
    yield f"{title:24}{'undamped':>12}{'epsilon_0 <':>13}{'damped':>12}{'epsilon_0 <':>13}"
    for both in zip(undamped, damped, strict=True):
        cells = (f"{one.margin:+12.4g}{'' if np.isnan(one.largest) else f'{one.largest:.3f}':>13}" for one in both)
        yield f"  {both[0].name:22}{''.join(cells)}"
    yield (
        f"Four degrees of freedom; each is to be positive. Damped: with the vehicle's own damping, in (6) and (7) at "
        f"up to {case.speed:g} m/s and rad/s."
    )
    if all(condition.holds for found in (undamped, damped) for condition in found[-2:]):
        yield "CERTIFIED by axes: V falls along every motion, whatever the constant loads are that it estimates."
    else:
        yield "NOT CERTIFIED by this V; that does not mean that it fails."
    for found, which in ((undamped, "undamped"), (damped, "damped")):
        for failure in failures(found, case.epsilon_0):
            yield f"- {which}: {failure}"
    if worst is not None:
        sign = "falls in all of them" if worst.share < 0 else "RISES in some"
        yield (
            f"V' at {worst.states} states sought by an optimiser, errors to {BOX[0]:g} m and 180 deg, {BOX[6]:g} m/s: "
            f"V {sign}; at worst {worst.share:+.3f} of what K_P and K_D take."
        )
