"""`rov-cosim tune`: the gains for a vehicle, by one rule."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from ...components.interface import POSE
from ...control.certificate import Certificate
from ...control.tuning import Rule, Timing, TuningError
from ...ssp.declaration import wire
from ...ssp.values import Value
from ...ssp.wiring import suggestion
from ...ssp.writer import parameter_set, values_set
from ...study.certificate_page import loop_lines, work_lines
from ...study.looped import loop_of
from ...study.screen import say
from ...systems import fleet
from ...systems.loop import CONTROLLER
from .. import options, outputs

_POSITIVE = options.Finite(min=0, min_open=True)
_SHARE = options.Finite(0, 1, min_open=True, max_open=True)
_KINDS = [controller for controller in fleet.CONTROLLERS if controller != "pd"]


@click.command()
@click.argument("vehicle")
@click.option("--controller", type=click.Choice(_KINDS), default=_KINDS[0], show_default=True, help="For this one.")
@click.option("--delay", type=click.IntRange(0, 10), default=0, help="Samples by which the measurement is late.")
@click.option(
    "--filter-time-constant",
    type=_POSITIVE,
    help="T_f of the lead filter in s; the system's if left out.",
)
@click.option(
    "--thruster-lag",
    type=options.Finite(min=0),
    help="Time constant of the thrusters in s; the vehicle's if left out.",
)
@click.option("--sample-time", type=_POSITIVE, help="Of arm, controller and coupling in s; 0.03 if left out.")
@click.option("--damping", type=_POSITIVE, help="Damping ratio.")
@click.option("--bandwidth", type=_POSITIVE, help="omega times the lag.")
@click.option(
    "--adapted",
    type=_SHARE,
    help="W Gamma W^T over the stiffness, but for the yaw of `extended`.",
)
@click.option("--integral", type=_POSITIVE, help="Integral gain over omega and the stiffness.")
@click.option(
    "--current",
    type=options.Finite(min=0),
    default=Rule.current,
    show_default=True,
    help="Speed in m/s of the current in which the yaw has to be held.",
)
@click.option(
    "-o",
    "--output",
    type=outputs.Place(".ssv"),
    help="Write the gains, for --parameters of `rov-cosim run`.",
)
@click.option(
    "--alone",
    type=outputs.Place(".ssv"),
    help="Write all parameters of the controller, for its FMU alone in another tool.",
)
@click.option(
    "--plot",
    type=outputs.Place(".png", ".svg"),
    help="Draw the margins.",
)
def command(
    vehicle: str,
    controller: str,
    delay: int,
    filter_time_constant: float | None,
    thruster_lag: float | None,
    sample_time: float | None,
    damping: float | None,
    bandwidth: float | None,
    adapted: float | None,
    integral: float | None,
    current: float,
    output: Path | None,
    alone: Path | None,
    plot: Path | None,
) -> None:
    """Tune a controller for VEHICLE, a name of the fleet or a file of the same parameters, VEHICLE.ssv.

    A figure of the rule that is left out is the one that the fleet takes for the controller and the vehicle.

    It ends with status 1 if the controlled axes of the level vehicle are unstable with the gains. A free roll or pitch
    that is unstable, which nothing controls, is a warning.
    """
    if vehicle not in fleet.VEHICLES and not vehicle.endswith(".ssv"):
        known = suggestion(vehicle, fleet.VEHICLES) or f" Known: {', '.join(fleet.VEHICLES)}; or name an .ssv."
        raise click.UsageError(f"there is no vehicle {vehicle}.{known}")
    plant = fleet.parameters_of(vehicle)
    component, system = fleet.CONTROLLERS[controller], fleet.holding(vehicle, controller)
    adapts = any(name.startswith("Gamma.") for name in component.p.names)
    if adapted is not None and not adapts:
        raise click.UsageError(f"--adapted is the share of what a law adapts; {controller} adapts nothing.")
    own = {**dict(zip(component.p.names, component.p.start.tolist(), strict=True)), **system.parameters[CONTROLLER]}
    lag = float(plant["thruster_time_constant"]) if thruster_lag is None else thruster_lag
    timing = Timing(
        sample_time or float(own["sample_time"]), filter_time_constant or float(own["filter_time_constant"]), lag, delay
    )
    given = {"bandwidth": bandwidth, "damping": damping, "adapted": adapted, "integral": integral}
    chosen = {name: figure for name, figure in given.items() if figure is not None}
    rule = replace(fleet.tuning_of(controller, vehicle).rule, current=current, **chosen)
    gains = fleet.tuned_for(controller, plant, timing, rule)
    of_loop: dict[str, Any] = {
        f"{CONTROLLER}.filter_time_constant": filter_time_constant,
        "rov_plant.thruster_time_constant": thruster_lag,
        "passive_arm.delay": delay or None,
        **dict.fromkeys((f"{CONTROLLER}.sample_time", "passive_arm.sample_time", "scenario.sample_time"), sample_time),
    }
    values: dict[str, Value] = {f"{CONTROLLER}.{name}": gain for name, gain in gains.items()}
    values |= {name: value for name, value in of_loop.items() if value is not None}

    system = replace(system, step_size=timing.sample_time)
    wiring = wire(system, progress=say).with_values(values)
    certificate = Certificate(system.name, loop_of(wiring))
    click.echo(f"{system.name}: lag {1e3 * timing.lag:.0f} ms, so omega {rule.omega(timing):.3g} rad/s")
    figures = {name: getattr(rule, name) for name in given if name != "adapted" or adapts}
    click.echo(f"By {', '.join(f'{name} {figure:g}' for name, figure in figures.items())}\n")
    for name, value in values.items():
        click.echo(f"{name} = {str(value).lower() if isinstance(value, bool) else f'{value:g}'}")
    click.echo()
    click.echo("\n".join([*loop_lines(certificate), *work_lines(certificate)]))
    click.echo(_in_current(certificate, current, rule.omega(timing)))
    if plot:
        from ...study.margin_plot import draw_margins  # loads matplotlib, which takes a while

        draw_margins(certificate, plot)
        click.echo(plot)
    if output:
        text = f"Gains of {controller} for {Path(vehicle).stem}, omega {rule.omega(timing):.3g} rad/s"
        output.write_bytes(values_set(wiring, values, Path(vehicle).stem, text))
        name = fleet.named(vehicle, controller)
        step = f" --step {sample_time:g}" if sample_time else ""
        click.echo(f"\n{output}: rov-cosim run {name} --parameters {output}{step}")
    if alone:
        (element,) = (element for element in wiring.elements if element.name == CONTROLLER)
        alone.write_bytes(parameter_set(element))
        click.echo(f"\n{alone}: all parameters of {component.name}.fmu for this vehicle")
    if not certificate.level.is_stable:
        raise TuningError(
            "The controlled axes are unstable with these gains: see the mode above; --bandwidth takes less."
        )


def _in_current(certificate: Certificate, current: float, omega: float) -> str:
    yaw = POSE.index("psi")
    if np.isinf(taken := certificate.softening(current)):
        return f"In a current of {current:g} m/s no rest of roll and pitch is found."
    stiffness, by_omega = certificate.gains.stiffness[yaw, yaw], certificate.inertia[yaw, yaw] * omega**2
    return (
        f"The stiffness in yaw is {stiffness:.3g} N m/rad, of which the loads and a current of {current:g} m/s "
        f"take up to {taken:.3g}; by omega alone it would be {by_omega:.3g}."
    )
