"""The guide of a kit: what lies in it, how to wire and run it, what every port means, how to prove an import."""

from collections.abc import Iterable
from importlib.metadata import distribution
from importlib.resources import files

from ..components.cases import Case
from ..components.interface import Component, Sampled, Signal
from ..control.tuning import MOST_IN_YAW, TuningError, earth_inertia
from ..exporters import native_export
from ..exporters.documentation import names, readme
from ..exporters.model_description import literal
from ..ssp.z_down import sign
from ..systems import fleet
from ..systems.gains import by_rule, inertia
from ..systems.loop import CONTROLLER, element_of

_SAMPLED = "samples are taken at multiples of `sample_time`"
_CONTINUOUS = "the vehicle is integrated in internal steps of at most `max_step`"


_PAGE = "| `live.html` | the loop with this controller, running: open it in a browser and drag a slider |\n"

_PLATFORMS = {
    "linux64": ("Linux (glibc 2.17 or newer)", "Linux"),
    "win64": ("Windows 10", "on Windows `binaries/win64/{name}.dll` and no `-ldl -lm`"),
    "darwin64": ("macOS 11", "on macOS `binaries/darwin64/{name}.dylib`"),
    "aarch64-linux": ("Linux on ARM", "on ARM `binaries/aarch64-linux/{name}.so`"),
    "aarch64-windows": ("Windows 11 on ARM", "on ARM `binaries/aarch64-windows/{name}.dll`"),
}
"""What each platform is called, and what differs there for a host in C."""


def guide(component: Component, cases: tuple[Case, ...], platforms: Iterable[str], *, has_page: bool = False) -> str:
    """Return the guide of a component in Markdown, with an FMU for some of `zig.TARGETS`, and with a page or not."""
    called, in_c = zip(*(_PLATFORMS[platform] for platform in _PLATFORMS if platform in set(platforms)), strict=True)
    description = native_export.description(component)
    tunable = [f"`{names(signal)}`" for signal in component.parameters if signal.tunable]
    required = [signal for signal in component.inputs if signal.type == "Boolean" and signal.key.endswith("valid")]
    essential = "".join(f"`{signal.key}` must be true for a measurement to be used. " for signal in required)
    page = readme(component).split("\n", 1)[1].strip()
    template = _text("guide.md.in")
    ports = [signal for signal in component.inputs + component.outputs if signal.axes]
    angle = next(name for signal in reversed(ports) for name in signal.names if name.endswith(".psi"))
    scalar, group = [signal for signal in ports if angle not in signal.names][:2]
    is_controller = element_of(component.name) == CONTROLLER
    return template.format(
        holding=_text("holding.md.in").replace("{name}", component.name) if is_controller else "",
        gains=_gains(component) if is_controller else "",
        page_row=_PAGE if has_page else "",
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
        valid="".join(f'    it["{signal.key}"] = True\n' for signal in required),
        begin="*Hold a vehicle in five minutes*" if is_controller else "*Run it*",
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
        output=component.outputs[0].key,
        home=_home(),
    )


def _home() -> str:
    """Return where the project says that it lives, if it does."""
    urls = distribution("rov-cosim").metadata.get_all("Project-URL") or []
    return "".join(f" {label}: <{url}>." for label, url in (one.split(", ", 1) for one in urls))


def _text(file: str) -> str:
    return (files(__package__) / file).read_text(encoding="utf-8")


def _gains(component: Component) -> str:
    """Return the section on gains for a vehicle, empty for a controller that the rule is not for."""
    of = {name: fleet.parameters_of(name) for name in fleet.VEHICLES}
    timing, rule = fleet.tuning_of(component.name)
    apart = [f"`{name}`" for name in of if fleet.tuning_of(component.name, name) != (timing, rule)]
    try:
        assert isinstance(component, Sampled)
        gains = {v: by_rule(component, p, timing, rule) for v, p in of.items()}
    except TuningError:
        return ""
    rows = {f"`{name}`": [gains[v][name] for v in of] for name in next(iter(gains.values()))}
    inertias = [earth_inertia(inertia(p)) for p in of.values()]
    head = {f"M {axis}": [M[i] for M in inertias] for i, axis in ((0, "x, y"), (2, "z"), (5, "psi"))}
    left_out = (".phi`", ".theta`", "M.x`", "M.y`", "K_P.y`", "K_D.y`", "K_I.y`")
    shown = head | {name: row for name, row in rows.items() if not name.endswith(left_out)}
    lines = [["", *(f"`{name}`" for name in of)], ["---"] * (len(of) + 1)]
    lines += [[name, *(f"{value:.4g}" for value in row)] for name, row in shown.items()]
    by_hand = _ADAPTED if "epsilon_0" in component.p.names else _INTEGRATED
    return _text("gains.md.in").format(
        name=component.name,
        lag=1e3 * timing.lag,
        sample_time=1e3 * timing.sample_time,
        filter=1e3 * timing.filter_time_constant,
        bandwidth=rule.bandwidth,
        omega=rule.omega(timing),
        apart=f" The systems of {' and '.join(apart)} have other figures, and other gains." if apart else "",
        current=rule.current,
        most=MOST_IN_YAW,
        rule=by_hand.format(
            adapted=rule.adapted,
            left=1 - rule.adapted,
            damping=2 * rule.damping,
            epsilon=rule.integral / rule.adapted,
            integral=rule.integral,
        ),
        table="\n".join(f"| {' | '.join(line)} |" for line in lines),
    )


_INTEGRATED = "    K_P = M omega^2        K_D = {damping:g} M omega        K_I = {integral:g} M omega^3"
_ADAPTED = """\
    K_P = {left:g} M omega^2        K_D = {damping:g} M omega        epsilon_0 = {epsilon:g} omega
    W Gamma W^T = {adapted:g} M omega^2

W Gamma W^T is what the adapted forces add up to in an axis. Forces that act in the same axis share it by the inertia
that each feels at its point of attack; what their levers make of the yaw counts there. By hand: half of
it for each of Gamma.F_A and Gamma.F_C along x and y, a third for each of dB, F_C.z and F_A.z. Where no arm pulls,
Gamma.F_A is 0, and the others share all of it. Levers that are short, or none, learn no yaw: then Gamma.M.z, the
couple's,
is W Gamma W^T of that axis, {adapted:g} M_psi omega^2."""


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
