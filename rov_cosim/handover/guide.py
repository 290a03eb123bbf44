"""The guide of a kit: what lies in it, how to wire and run it, what every port means, how to prove an import."""

from collections.abc import Iterable
from importlib.resources import files

from ..components.cases import Case
from ..components.interface import Component, Sampled, Signal
from ..exporters import native_export
from ..exporters.documentation import names, readme
from ..exporters.model_description import literal
from ..ssp.z_down import sign
from ..systems.loop import element_of

_SAMPLED = "samples are taken at multiples of `sample_time`"
_CONTINUOUS = "the vehicle is integrated in internal steps of at most `max_step`"


_PLATFORMS = {
    "linux64": ("Linux (glibc 2.17 or newer)", "Linux"),
    "win64": ("Windows 10", "on Windows `binaries/win64/{name}.dll` and no `-ldl -lm`"),
    "darwin64": ("macOS 11", "on macOS `binaries/darwin64/{name}.dylib`"),
    "aarch64-linux": ("Linux on ARM", "on ARM `binaries/aarch64-linux/{name}.so`"),
    "aarch64-windows": ("Windows 11 on ARM", "on ARM `binaries/aarch64-windows/{name}.dll`"),
}
"""What each platform is called, and what differs there for a host in C."""


def guide(component: Component, cases: tuple[Case, ...], platforms: Iterable[str]) -> str:
    """Return the guide of a component in Markdown, with an FMU for some of `zig.TARGETS`."""
    called, in_c = zip(*(_PLATFORMS[platform] for platform in _PLATFORMS if platform in set(platforms)), strict=True)
    description = native_export.description(component)
    tunable = [f"`{names(signal)}`" for signal in component.parameters if signal.tunable]
    required = [signal for signal in component.inputs if signal.type == "Boolean" and signal.key.endswith("valid")]
    essential = "".join(f"`{signal.key}` must be true for a measurement to be used. " for signal in required)
    page = readme(component).split("\n", 1)[1].strip()
    template = (files(__package__) / "guide.md.in").read_text(encoding="utf-8")
    ports = [signal for signal in component.inputs + component.outputs if signal.axes]
    angle = next(name for signal in reversed(ports) for name in signal.names if name.endswith(".psi"))
    scalar, group = [signal for signal in ports if angle not in signal.names][:2]
    return template.format(
        title=component.title,
        name=component.name,
        description=component.description,
        version=description.version,
        platforms=" and ".join(filter(None, [", ".join(called[:-1]), called[-1]])),
        in_c=", ".join(in_c).format(name=component.name),
        guid=native_export.description(component).guid,
        first=cases[0].name,
        stop_time=cases[0].times()[-1],
        essential=essential.strip(),
        cases="\n".join(f"| `{case.name}` | {case.description} |" for case in cases),
        inputs=_ports(component.inputs, with_start=True),
        outputs=_ports(component.outputs, with_start=False),
        parameters=_ports(component.parameters, with_start=True),
        timing=_SAMPLED if isinstance(component, Sampled) else _CONTINUOUS,
        tunable=", ".join(tunable) or "none",
        page=page,
        element=element_of(component.name),
        scalar=scalar.names[0],
        angle=angle,
        group=group.key,
    )


def _ports(signals: tuple[Signal, ...], with_start: bool) -> str:
    columns = (
        ["port", "unit", "start", "z down", "what it is"] if with_start else ["port", "unit", "z down", "what it is"]
    )
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for signal in signals:
        cells = {
            "port": f"`{names(signal)}`" + ("" if signal.type == "Real" else f" ({signal.type})"),
            "unit": ", ".join(dict.fromkeys(signal.units)),
            "start": _common([literal(v, signal.type) for v in signal.elements(signal.start)]),
            "z down": _common(["-" if sign(name) < 0 else "+" for name in signal.names]),
            "what it is": signal.description,
        }
        lines.append("| " + " | ".join(cells[column] for column in columns) + " |")
    return "\n".join(lines)


def _common(values: list[str]) -> str:
    return values[0] if len(set(values)) == 1 else " ".join(values)
