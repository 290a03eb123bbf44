"""The live page of a kit: the loops with its controller, running in one HTML file."""

from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path

from ..components.interface import Component
from ..report import bundle, live, page
from ..ssp.declaration import System, wire
from ..systems.fleet import CONTROLLERS, VEHICLES, holding

NAME = "live.html"


def systems(component: Component) -> dict[tuple[str, str], System]:
    """Return the systems of the page by vehicle and controller: none for a component that is no controller."""
    controllers = [name for name in live.LABELS if CONTROLLERS[name].name == component.name]
    return {pair: holding(*pair) for pair in product(VEHICLES, controllers)}


def written(
    component: Component,
    fmus: Mapping[str, Path] | None = None,
    progress: Callable[[str], object] = lambda line: None,
) -> bytes | None:
    """Return the page of a controller; None for a component that is none.

    Parameters
    ----------
    fmus : native FMUs by their component; those of this project, built if they are not current, if left out.
    progress : is told in a line what begins.

    Raises
    ------
    BundleError : npm is not installed, or cannot have the libraries of the page.
    BuildError : the compiler fails.
    """
    declared = systems(component)
    if not declared:
        return None
    bundled = bundle.bundled(*page.REPORT, progress=progress)
    loops = {pair: wire(system, fmus, progress=progress) for pair, system in declared.items()}
    about = page.About(
        f"The hand-over of {component.name}",
        f"{component.title}: the loop, running",
        f"The C of {component.name}.fmu holds a vehicle against forces that it does not know. Try it on yours in five "
        "minutes: the guide beside this page says how.",
        f"rov-cosim handover {component.name}",
    )
    return page.report(live.data(loops, progress), (), bundled, about).encode()
