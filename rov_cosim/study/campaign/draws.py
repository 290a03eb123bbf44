"""The values that vary, run by run: drawn by `scipy.stats` from a seed, and checked against what the FMUs declare."""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable
from numpy.typing import NDArray
from scipy import stats
from scipy.stats import qmc

from ...ssp.values import Value, value_of
from ...ssp.wiring import Wiring, WiringError, suggestion
from .declared import Declared, Varied

Table = Mapping[str, NDArray[Any]]
"""The values by ``element.variable``, and the troubles by ``trouble``, each of shape (runs,)."""

_DTYPES: dict[str, type] = {"Real": np.float64, "Integer": np.int64, "Boolean": np.bool_}
_LISTS: dict[str, tuple[tuple[type, ...], str, type]] = {
    "Real": ((int, float), "numbers", np.float64),
    "Integer": ((int,), "whole numbers", np.int64),
    "Boolean": ((bool,), "true or false", np.bool_),
    "String": ((str,), "texts in quotes", object),
    "Enumeration": ((str,), "names of its items in quotes", object),
}
"""What a list has for a variable of a type, and the type of its column."""
_LOWEST = 2.0**-31
"""Half of what Sobol' numbers are multiples of: a 0 among them would be minus infinity of a normal distribution."""


def drawn(declared: Declared, wiring: Wiring) -> Table:
    """Return what varies in each run of a campaign: all draws for the first combination of the grid, then the next.

    Raises
    ------
    WiringError : everything that is wrong with names, distributions and limits.
    """
    problems = _unknown(declared, wiring)
    columns: dict[str, NDArray[Any]] = {}
    if not problems:
        u = unit_draws(len(declared.vary), declared.runs, declared.sampling, declared.seed)
        for (end, varied), share in zip(declared.vary.items(), u.T, strict=True):
            columns[end] = _column(end, varied, share, _variable(wiring, end), problems)
        combined = np.array(list(product(*(range(len(values)) for values in declared.grid.values()))), dtype=int)
        columns = {end: np.tile(column, len(combined)) for end, column in columns.items()}
        for (end, values), places in zip(declared.grid.items(), combined.T, strict=True):
            choices = _array(end, values, _variable(wiring, end), problems)
            columns[end] = np.repeat(choices[places], declared.runs) if len(choices) else choices
    if not problems:
        for end, column in columns.items():
            also = declared.vary[end].also if end in declared.vary else ()
            for name in (end, *also) if end != "trouble" else ():
                problems += _beyond(name, _variable(wiring, name), column)
    if problems:
        raise WiringError(wiring.name, problems)
    return columns


def unit_draws(dimensions: int, runs: int, sampling: str, seed: int) -> NDArray[np.float64]:
    """Return points of the open unit cube, shape (runs, dimensions), by one of `declared.SAMPLINGS`."""
    if sampling == "sobol":
        # Of a number of points that is no power of two scipy warns; the first of more are the same points.
        power = int(np.ceil(np.log2(max(runs, 1))))
        u = qmc.Sobol(max(dimensions, 1), rng=np.random.default_rng(seed)).random_base2(power)[:runs, :dimensions]
    elif sampling == "latin_hypercube":
        u = qmc.LatinHypercube(max(dimensions, 1), rng=np.random.default_rng(seed)).random(runs)[:, :dimensions]
    else:
        u = np.random.default_rng(seed).random((runs, dimensions))
    inside: NDArray[np.float64] = np.clip(u, _LOWEST, 1 - _LOWEST)
    return inside


def _unknown(declared: Declared, wiring: Wiring) -> list[str]:
    """Return a sentence for every variable that there is not, that cannot be set, or that two entries set."""
    names: dict[str, Value | str] = {}
    problems = []
    firsts = {end: (*varied.values, 0)[0] for end, varied in declared.vary.items()}
    for end, first in {**firsts, **{end: values[0] for end, values in declared.grid.items()}}.items():
        for name in (end, *(declared.vary[end].also if end in declared.vary else ())):
            if name in names or (name in declared.changes.values and name != end):
                problems.append(f"{name} is set twice: leave one out.")
            if name != "trouble":
                names[name] = first
    try:
        wiring.with_values(names)
    except WiringError as error:
        problems += error.problems
    for end, varied in declared.vary.items():
        if end == "trouble" and (varied.distribution or varied.also):
            problems.append("[vary] trouble: expected a list of names.")
        elif end != "trouble" and not problems:
            types = {name: _variable(wiring, name).type for name in (end, *varied.also)}
            problems += [
                f"{name} is of type {type_}, and {end}, from which it has its value, of type {types[end]}."
                for name, type_ in types.items()
                if type_ != types[end]
            ]
    return problems


def _variable(wiring: Wiring, end: str) -> ModelVariable:
    element, variable = wiring.parted(end)
    return element.variables[variable] if element else None


def _column(
    end: str, varied: Varied, u: NDArray[np.float64], variable: ModelVariable, problems: list[str]
) -> NDArray[Any]:
    """Return the values of a variable for points of the unit interval, and add to `problems` what is wrong."""
    if varied.values:
        choices = _array(end, varied.values, variable, problems)
        return choices[np.minimum((u * len(choices)).astype(int), len(choices) - 1)] if len(choices) else choices
    found = _frozen(end, varied, problems)
    if found is None:
        return np.zeros(0)
    distribution, is_discrete = found
    if variable.type not in _DTYPES:
        problems.append(f"[vary] {end} is of type {variable.type}: take a list.")
        return np.zeros(0)
    if variable.type != "Real" and not is_discrete:
        cure = "randint or bernoulli" if variable.type == "Boolean" else "randint"
        problems.append(f"[vary] {end} is of type {variable.type}: take a discrete distribution, as {cure}, or a list.")
        return np.zeros(0)
    values = distribution.ppf(u)
    if not np.isfinite(values).all():
        shown = ", ".join(f"{key} = {value:g}" for key, value in varied.arguments.items())
        problems.append(f"[vary] {end}: scipy.stats.{varied.distribution} draws nothing with {shown}: see its page.")
        return np.zeros(0)
    if variable.type == "Boolean" and not np.isin(values, (0, 1)).all():
        problems.append(f"[vary] {end} is of type Boolean: take bernoulli, or a list.")
    return np.asarray(values).astype(_DTYPES[variable.type])


def _frozen(end: str, varied: Varied, problems: list[str]) -> tuple[Any, bool] | None:
    """Return a distribution with its arguments, and whether it is discrete."""
    where, name = f"[vary] {end}", varied.distribution
    generator: Any = getattr(stats, name, None)
    is_discrete = isinstance(generator, stats.rv_discrete)
    if not is_discrete and not isinstance(generator, stats.rv_continuous):
        known = [n for n in dir(stats) if isinstance(getattr(stats, n), stats.rv_continuous | stats.rv_discrete)]
        hint = suggestion(name, known) or " It has norm, uniform, lognorm, truncnorm, randint and a hundred more."
        problems.append(f"{where}: scipy.stats has no distribution {name}.{hint}")
        return None
    needed = generator.shapes.replace(" ", "").split(",") if generator.shapes else []
    known = [*needed, "loc", *([] if is_discrete else ["scale"])]
    wrong = [
        f"{where}: {name} has no argument {argument}; expected {', '.join(known)}.{suggestion(argument, known)}"
        for argument in varied.arguments
        if argument not in known
    ]
    wrong += [f"{where}: {name} needs {argument}." for argument in needed if argument not in varied.arguments]
    problems += wrong
    return None if wrong else (generator(**varied.arguments), is_discrete)


def _array(end: str, values: tuple[Any, ...], variable: ModelVariable, problems: list[str]) -> NDArray[Any]:
    """Return the values of a list in the type of the variable."""
    if variable is None:
        return np.array(values, dtype=object)
    type_, kind, dtype = _LISTS[variable.type]
    if wrong := [value for value in values if type(value) not in type_]:
        problems.append(f"{end} is of type {variable.type}: expected {kind}, got {wrong[0]!r}.")
        return np.zeros(0)
    for value in values:
        try:
            value_of(str(value), variable)
        except ValueError as error:
            problems.append(f"{end}: {error}")
            return np.zeros(0)
    return np.array(values, dtype=dtype)


def _beyond(end: str, variable: ModelVariable, column: NDArray[Any]) -> list[str]:
    """Return a sentence if values are beyond what the FMU declares."""
    if variable.type not in ("Real", "Integer"):
        return []
    least = -np.inf if variable.min is None else float(variable.min)
    most = np.inf if variable.max is None else float(variable.max)
    beyond = (column < least) | (column > most)
    if not beyond.any():
        return []
    run = int(np.argmax(beyond))
    limit = f"its least, {least:g}" if column[run] < least else f"its most, {most:g}"
    side = "below" if column[run] < least else "above"
    return [
        f"{end}: {beyond.sum()} of {len(column)} runs are out of its range, the first, run {run}, with {column[run]:g} "
        f"{side} {limit}: take a narrower distribution, as truncnorm."
    ]
