"""`rov-cosim report`: the paper, and its loop running, on one page."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click

from ...exporters.build import project_root
from ...study.screen import say
from ...systems import fleet
from .. import outputs


@click.command()
@click.argument("vehicles", metavar="[VEHICLE.ssv]...", nargs=-1, type=click.Path(exists=True, dir_okay=False))
@click.option(
    "--output",
    type=outputs.Place(".html"),
    help="The page; build/report/report.html if left out.",
)
@click.option("--live-only", is_flag=True, help="The loop alone, without figures, claims and certificate.")
def command(vehicles: tuple[str, ...], output: Path | None, live_only: bool) -> None:
    """Write the page: the loop in it, the paper's figures and claims; with vehicles of yours, they come first."""
    from ...report import bundle, live, page, sections  # what it loads takes a while

    output = output or project_root() / "build" / "report" / "report.html"
    for vehicle in vehicles:
        fleet.parameters_of(vehicle)
    with ThreadPoolExecutor() as beside:  # npm and the compiler are processes of their own
        bundled = beside.submit(bundle.bundled, *page.REPORT, progress=say)
        loops = live.loops(vehicles, progress=say)
        data = beside.submit(live.data, loops, progress=say)
        found = [] if live_only else sections.all_of(progress=say)
        text = page.report(data.result(), found, bundled.result())
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding="utf-8")
    click.echo(f"{output}: {len(text.encode()) / 1e6:.2f} MB")
