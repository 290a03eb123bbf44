"""What makes a run differ from the plain system: other FMUs, other values, troubles."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

from ..ssp.parameter_set import read_values
from ..ssp.swap_map import SwapMap
from ..ssp.swapping import with_swaps
from ..ssp.values import Value
from ..ssp.wiring import Wiring, WiringError, suggestion
from .troubles import TROUBLES


def plain(value: Value | str) -> str:
    """Return a value as a name has it, the same for all literals of a number."""
    text = str(value).strip().lower()
    try:
        return repr(float(text)).removesuffix(".0")
    except ValueError:
        return text


@dataclass(frozen=True)
class Changes:
    """Changes of a system, applied in this order.

    Parameters
    ----------
    swaps : FMU files that take the place of elements, by element.
    maps : how, by element; an element needs none whose FMU has the same names.
    values : other start values, by ``element.variable``, as values or literals.
    troubles : names of `TROUBLES` that come over it then, scaled by the values that hold by then.
    parameters : SSV files of start values, by ``element.variable``; `values` go before them.
    """

    swaps: Mapping[str, Path] = field(default_factory=dict)
    maps: Mapping[str, SwapMap] = field(default_factory=dict)
    values: Mapping[str, Value | str] = field(default_factory=dict)
    troubles: tuple[str, ...] = ()
    parameters: tuple[Path, ...] = ()

    def applied(self, wiring: Wiring, warn: Callable[[str], None] = lambda message: None) -> Wiring:
        """Return a system with the changes in it, and in its name.

        Raises
        ------
        WiringError : a swap, the map or a value is wrong, or a trouble does not apply to the system.
        """
        if unknown := [name for name in self.troubles if name not in TROUBLES]:
            problems = [f"There is no trouble {name}.{suggestion(name, TROUBLES)}" for name in unknown]
            raise WiringError(wiring.name, problems)
        changed = with_swaps(wiring, self.swaps, self.maps, warn)
        for path in self.parameters:
            changed = changed.with_values(read_values(path, changed, warn))
        changed = changed.with_values(self.values)
        by = dict.fromkeys(self.values, "")
        for name in self.troubles:
            values = TROUBLES[name].values_in(changed)
            before, changed = changed, changed.with_values(values)
            for end in values:
                if by.get(end):
                    problem = f"The troubles {by[end]} and {name} both set {end}: take one of them."
                    raise WiringError(wiring.name, [problem])
                if end in by and changed.value(end) != before.value(end):
                    warn(f"{name} makes {end} {changed.value(end)}; it was set to {before.value(end)}.")
                by[end] = name
        return replace(changed, name="+".join([wiring.name, *self.words()]))

    def words(self) -> list[str]:
        """Return a word for each change, the same for the same change alone."""
        swaps = [f"{name}={fmu.stem}-{self._digest(name)}" for name, fmu in self.swaps.items()]
        files = [f"{path.stem}-{sha256(path.read_bytes()).hexdigest()[:6]}" for path in self.parameters]
        return [
            *swaps,
            *files,
            *(f"{end}={plain(value)}" for end, value in sorted(self.values.items())),
            *self.troubles,
        ]

    def _digest(self, element: str) -> str:
        """Return what tells FMUs of one file name, and their maps, apart."""
        fmu = self.swaps[element]
        content = fmu.read_bytes() if fmu.is_file() else b""
        return sha256(content + repr(self.maps.get(element)).encode()).hexdigest()[:6]
