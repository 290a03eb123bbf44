"""The pages in a browser: what they show beside the master's numbers, by hand, by keyboard and by link."""

import csv
import gzip
import shlex
import shutil
import statistics
from base64 import b64decode
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from pythonfmu.builder import FmuBuilder

from rov_cosim.cli.main import main
from rov_cosim.exporters.build import components, project_root
from rov_cosim.handover import live
from rov_cosim.report.controls import CONTROLS
from rov_cosim.report.live import LABELS, RECORDED, loops
from rov_cosim.report.page import _in_script
from rov_cosim.report.view import ViewError, geometry
from rov_cosim.report.view import data as view_data
from rov_cosim.ssp import swap_map
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.assessment import axes
from rov_cosim.study.changes import Changes
from rov_cosim.study.matrix import wired
from rov_cosim.study.runs import opened, simulated
from rov_cosim.study.scores import score
from rov_cosim.study.settings import Settings
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.systems.fleet import CONTROLLERS, file_of

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
MOST_BYTES = 3_000_000
OWN = "GL Driver Message"
"""What Chromium says of its own drawing where there is no GPU."""
SEEN = ".figures figure, .prose { content-visibility: visible !important; }"
"""Everything is laid out, though it is not in view."""
REST = 500
"""Time in ms after which nothing is drawn any more."""


def in_browser(test):
    return pytest.mark.slow(pytest.mark.skipif(BROWSER is None, reason="no browser: apt-get install chromium")(test))


def command(*words):
    done = CliRunner().invoke(main, list(map(str, words)))
    assert done.exit_code == 0, done.output
    return done


@pytest.fixture(scope="module")
def report(fmus, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    command("report", "--output", path)
    return path


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield opened
        opened.close()


@contextmanager
def page_of(browser, path, link="", width=1280, scheme="light", ready="#live[data-runs]"):
    """Open a page, and see that it says nothing on the console."""
    said = []
    context = browser.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce", offline=True
    )
    page = context.new_page()
    page.on("console", lambda message: OWN not in message.text and said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(f"{path.as_uri()}{link}")
    page.wait_for_selector(ready, timeout=120_000)
    yield page
    context.close()
    assert said == []


def changed(page, change):
    """Change something on the page and wait for the runs that follow."""
    before = int(page.locator("#live").get_attribute("data-runs"))
    change()
    page.wait_for_function(f"Number(document.querySelector('#live').dataset.runs) > {before}", timeout=120_000)


def shown(page):
    """Return the cells of the table by controller."""
    lines = page.locator("#results tbody tr").all()
    return {line.get_attribute("data-controller"): line.locator("td").all_inner_texts() for line in lines}


def cells(words):
    """Return the cells that the command of these words gives, by the master."""
    assert words[:2] == ["rov-cosim", "run"]
    given = dict(zip(words[3::2], words[4::2], strict=True))
    values = dict(word.split("=") for option, word in zip(words[3::2], words[4::2], strict=True) if option == "--set")
    settings = Settings(given.get("--coupling", "jacobi"), stop_time=float(given["--stop-time"]))
    with opened(SYSTEMS[words[2]]) as wiring:
        run = simulated(wiring.with_values(values), settings, progress=lambda steps: steps)
    found = score(run.results, run.wiring, run.failure)
    yield found.verdict
    yield "never" if found.settling is None else f"{found.settling:.2f}"
    for axis in axes(run.results, run.wiring):
        scale = 180 / np.pi if axis.name == "psi" else 1e3
        for value in (axis.mean, axis.worst):
            yield f"{value * scale:.2f}".replace("-0.00", "0.00")


LINKS = {
    "": list(CONTROLLERS),
    "coupling=1&stop=60&noise=0.01&seed=5&delay=2&Gamma=2.5&K_P.x=1.7&dropout=0.2": ["adaptive_pd", "pid", "pd"],
    "vehicle=bluerov2_heavy&pull.y=10&pull_begin=20&lost=2&lost_begin=40&current.x=0.1": [
        "extended",
        "pid",
        "adaptive_pd",
    ],
    "vehicle=rexrov&delay=9&adaptation=off&eta_0.x=0.3": ["adaptive_pd", "pid", "sun_cheah"],
    "vehicle=minerva&step.x=0.2&step_begin=30&dB=-20&stop=120": ["sliding_mode", "extended"],
    "eta_0.x=-0.8&eta_0.y=-0.8": ["pd", "pid", "adaptive_pd"],
}


@pytest.mark.parametrize("link", LINKS)
@in_browser
def test_the_table_has_the_masters_numbers_by_the_command_that_it_gives(report, browser, link):
    with page_of(browser, report, f"#{link}&shown={','.join(LINKS[link])}") as page:
        found = shown(page)
        assert set(found) == set(LINKS[link])
        for controller in found:
            page.check(f'#results input[value="{controller}"]')
            words = shlex.split(page.locator("#command").inner_text())
            assert found[controller] == list(cells(words)), words


@in_browser
def test_a_slider_moved_by_hand_or_key_runs_again_and_is_told_by_the_link(report, browser):
    with page_of(browser, report) as page:
        slider = page.locator('[data-key="K_P.z"]')
        before = shown(page)
        slider.focus()
        changed(page, lambda: page.keyboard.press("End"))
        after = shown(page)
        assert after != before
        link = page.url
        assert "K_P.z=10" in link
        changed(page, lambda: page.locator("#reset").press("Enter"))
        assert shown(page) == before
        assert "#" not in page.url
    with page_of(browser, report, link[link.index("#") :]) as page:
        assert shown(page) == after
    with page_of(browser, report, "#vehicle=none&K_P.x=abc&stop=-1&focus=__proto__") as page:
        assert shown(page) == before  # what a link says wrongly is passed over


@in_browser
def test_the_lyapunov_function_follows_the_gains_and_says_where_there_is_none(report, browser):
    from playwright.sync_api import expect

    with page_of(browser, report, "#noise=0&noise_angle=0") as page:
        curve, note = page.locator("#plot-lyapunov"), page.locator("#note-lyapunov")

        def drawn():
            return curve.locator("canvas").evaluate("canvas => canvas.toDataURL()")

        before = drawn()
        assert note.inner_text().startswith("Of forces that act alike the sum alone is learned: V ends above zero.")
        assert "current" not in note.inner_text()
        slider = page.locator('[data-key="K_P.y"]')
        slider.focus()
        changed(page, lambda: page.keyboard.press("ArrowLeft"))
        assert drawn() != before
        changed(page, lambda: page.keyboard.press("ArrowRight"))
        assert drawn() == before
        changed(page, lambda: page.evaluate("location.hash += '&current.x=0.1'"))
        expect(note).to_contain_text("It need not fall: a current flows")
        page.check('#results input[value="pd"]')
        expect(note).to_contain_text("nothing is adapted")
        page.check('#results input[value="pid"]')
        expect(note).to_have_text("None here: the proof is of the paper's law.")
        assert not curve.is_visible()


@pytest.mark.parametrize(("name", "holds"), [("pid", ["pid"]), ("sliding_mode", ["sliding_mode"])])
@in_browser
def test_the_page_of_a_kit_has_its_controller_in_the_loop(fmus, browser, tmp_path, name, holds):
    path = tmp_path / live.NAME
    path.write_bytes(live.written(components()[name]))
    assert path.stat().st_size < MOST_BYTES
    with page_of(browser, path, width=390) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        found = shown(page)
        assert list(found) == holds
        assert found[name] == list(cells(shlex.split(page.locator("#command").inner_text())))


@in_browser
def test_it_fits_every_screen_and_is_small(report, browser):
    assert report.stat().st_size < MOST_BYTES
    pictures = project_root() / "build" / "report"
    for width in (390, 1280):
        for scheme in ("light", "dark"):
            with page_of(browser, report, width=width, scheme=scheme) as page:
                page.add_style_tag(content=SEEN)
                assert page.evaluate("document.documentElement.scrollWidth") <= width
                page.locator(".scrub").fill("12")
                page.screenshot(path=pictures / f"report-{width}-{scheme}.png", full_page=True)


@in_browser
def test_it_plays_by_keyboard_and_tells_what_it_takes(report, browser, capsys):
    with page_of(browser, report) as page:
        play = page.locator(".play")
        assert play.inner_text() == "Play"  # nothing moves by itself
        play.press("Enter")
        page.wait_for_function("Number(document.querySelector('.scrub').value) > 1", timeout=60_000)
        play.press("Enter")
        assert play.inner_text() == "Play"
        page.locator("#stop").fill("60")
        changed(page, lambda: page.locator("#stop").press("Tab"))
        took, whole = [], []
        page.locator(".curves").scroll_into_view_if_needed()
        for _ in range(15):
            page.wait_for_timeout(REST)
            changed(page, lambda: page.locator('[data-key="K_P.x"]').press("ArrowRight"))
            took.append(float(page.locator("#live").get_attribute("data-took")))
            whole.append(float(page.locator("#live").get_attribute("data-all")))
        page.locator(".play").press("Enter")
        page.wait_for_timeout(5000)
        frames = [float(ms) for ms in (page.locator(".player").get_attribute("data-frames") or "").split()]
    with capsys.disabled():
        for what, times in (("the loop in focus", took), ("all three", whole)):
            least, middle = min(times), statistics.median(times)
            print(f"\n60 s of {what} on screen after {least:.0f} ms at best, {middle:.0f} as a rule")
        print(f"{len(frames)} frames, {statistics.median(frames):.0f} ms as a rule, {max(frames):.0f} ms at most")


@in_browser
def test_curves_and_table_follow_a_hand_that_does_not_rest(report, browser):
    with page_of(browser, report) as page:
        before = int(page.locator("#live").get_attribute("data-runs"))
        seen, is_old_told = page.evaluate(
            """async () => {
              const slider = document.querySelector('[data-key="eta_0.x"]');
              const cell = () => document.querySelector('[data-controller="adaptive_pd"]').textContent;
              const row = document.querySelector.bind(document, '[data-controller="pid"]');
              const [seen, faded] = [new Set(), new Set()];
              slider.value = -0.8;
              for (let k = 0; k < 60; k++) {
                slider.stepUp();
                slider.dispatchEvent(new Event("input", { bubbles: true }));
                await new Promise(requestAnimationFrame);
                seen.add(cell());
                faded.add(getComputedStyle(row()).opacity);
              }
              return [seen.size, faded.has("0.5")];
            }"""
        )
        assert seen > 3
        assert is_old_told
        page.wait_for_function(f"Number(document.querySelector('#live').dataset.runs) > {before}", timeout=120_000)
        assert page.locator("#results tr.old").count() == 0
        assert shown(page)["adaptive_pd"] == list(cells(shlex.split(page.locator("#command").inner_text())))


@in_browser
def test_any_table_of_results_is_a_moving_picture(fmus, browser, tmp_path):
    command("run", "station_keeping", "--stop-time", "9", "--output", tmp_path)
    table = next(tmp_path.glob("*.csv"))
    command("view", table)
    with table.open(encoding="utf-8") as file:
        rows = len(list(csv.reader(file))) - 1
    with page_of(browser, table.with_suffix(".html"), ready="#view[data-rows]", width=390) as page:
        assert page.locator("#view").get_attribute("data-rows") == str(rows)
        page.locator(".scrub").fill("6")
        assert page.locator(".clock").inner_text() == "6.0 s"
        assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_every_control_sets_what_some_system_has_and_every_column_is_there(fmus):
    wirings = wired(["hoang_kreuzer"], list(CONTROLLERS)).values()
    controls = [control for group in CONTROLS.values() for control in group]
    assert len({control.key for control in controls}) == len(controls)
    for control in controls:
        for end in control.sets:
            assert any(wiring.value(end) is not None for wiring in wirings), end
        assert control.low < control.high
    assert set(LABELS) == set(CONTROLLERS)
    outputs = {output for wiring in wirings for output in wiring.outputs}
    assert set(RECORDED) <= outputs


def test_a_vehicle_of_ones_own_comes_first(fmus, tmp_path):
    own = shutil.copy(file_of("bluerov2"), tmp_path / "own.ssv")
    assert next(iter(loops([str(own)]))) == (str(own), "adaptive_pd")


def test_a_table_that_is_none_is_told(fmus, tmp_path):
    def refused(text):
        path = tmp_path / "results.csv"
        path.write_text(text, encoding="utf-8")
        done = CliRunner().invoke(main, ["view", str(path)])
        assert done.exit_code == 1
        return done.output

    assert "no table of results" in refused("time,rov_plant.eta.x\n0,abc\n1,2\n")
    told = refused("time,ship.north\n0,1\n1,2\n")
    assert "has no rov_plant.eta.x" in told
    assert "--column rov_plant.eta.x=COLUMN. It has time, ship.north." in told
    assert "two at least" in refused("time,rov_plant.eta.x\n0,1\n")


def columns_of(made):
    return np.frombuffer(gzip.decompress(b64decode(made["columns"]))).reshape(len(made["names"]), -1)


NED = """
[rov_plant]
without = ["u", "F_arm"]
[rov_plant.variables]
pose = { ours = "eta", z_down = true }
force = { ours = "controller.tau", z_down = true }
[rov_plant.constants]
nu = 0.0
"""


def test_the_columns_of_a_table_come_back(fmus, tmp_path):
    names = ["time", *(f"rov_plant.eta.{axis}" for axis in ("x", "y", "z", "phi", "theta", "psi"))]
    values = np.random.default_rng(1).normal(size=(5, len(names)))
    path = tmp_path / "some.csv"
    lines = [",".join(f'"{name}"' for name in names), *(",".join(map(repr, row)) for row in values.tolist())]
    path.write_text("\n".join(lines), encoding="utf-8")
    wiring = wire(SYSTEMS["station_keeping"])
    made = view_data(path, wiring, geometry(wiring))
    found = columns_of(made)
    assert made["names"] == [*names, *(f"scenario.eta_d.{axis}" for axis in ("x", "y", "z", "phi", "theta", "psi"))]
    assert np.array_equal(found[: len(names)], values.T)
    assert not found[len(names) :].any()  # what the controller of this system has
    assert made["geometry"]["passive_arm.L[1]"] == 0.7


def test_the_pose_of_a_vehicle_of_another_make_is_found_by_its_map_or_by_its_columns(fmus, tmp_path):
    their = FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "ned_plant.py", tmp_path)
    map_ = tmp_path / "map.toml"
    map_.write_text(NED, encoding="utf-8")
    swap = ("--swap", f"rov_plant={their}", "--map", map_)
    command("run", "station_keeping", *swap, "--stop-time", "3", "--output", tmp_path)
    table = next(tmp_path.glob("*.csv"))
    done = CliRunner().invoke(main, ["view", str(table)])
    assert done.exit_code == 1
    assert "with --swap and --map as in the run" in done.output
    plain = wire(SYSTEMS["station_keeping"])
    changed = Changes({"rov_plant": Path(their)}, swap_map.read(map_)).applied(plain)
    by_map = view_data(table, changed, geometry(plain))
    columns = {"rov_plant.eta": "rov_plant.pose"} | {f"rov_plant.eta.{a}": f"-1*rov_plant.pose.{a}" for a in ("y", "z")}
    by_hand = view_data(table, plain, geometry(plain), columns | {"rov_plant.eta.psi": "-rov_plant.pose.psi"})
    theirs = np.genfromtxt(table, delimiter=",", names=True, deletechars="")
    for made in (by_map, by_hand):
        found = dict(zip(made["names"], columns_of(made), strict=True))
        for axis, sign in {"x": 1, "y": -1, "z": -1, "psi": -1}.items():
            np.testing.assert_allclose(found[f"rov_plant.eta.{axis}"], sign * theirs[f"rov_plant.pose.{axis}"], atol=0)
    with pytest.raises(ViewError, match=r"no column rov_plant.poze. Did you mean rov_plant.pose"):
        view_data(table, plain, {}, {"rov_plant.eta.x": "rov_plant.poze"})
    with pytest.raises(ViewError, match=r"nothing of that name is drawn. Did you mean rov_plant.eta"):
        view_data(table, plain, {}, {"rov_plant.etta.x": "rov_plant.pose.x"})
    with pytest.raises(ViewError, match=r"'two' is no factor"):
        view_data(table, plain, {}, {"rov_plant.eta.x": "two*rov_plant.pose.x"})


def test_no_text_ends_a_script():
    assert "</script" not in _in_script("a</script>b")
    assert "<!--" not in _in_script("<!--")
