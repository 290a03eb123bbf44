"""The file of a gate: which limits hold in a cell, and what is said of a wrong one before anything runs."""

import pytest
from test_campaign import written

from rov_cosim.cli.commands import gate as command
from rov_cosim.study.gate import declared
from rov_cosim.study.gate.vacuous import released
from rov_cosim.study.limits import MEASURES, broken, problem_of
from rov_cosim.study.scores import Score
from rov_cosim.systems.catalogue import SYSTEMS
from typed import call, one_line

LIMITS = """\
troubles = ["still_water", "current"]
stop_time = 90.0
[limits]
worst = 0.02
effort = 50.0
[limits.current]
worst = 0.04
settling = 80.0
[systems.rexrov]
without = ["current"]
[systems.mine]
system = "bluerov2"
swaps = { rov_plant = "their.fmu" }
values = { "controller.K_P.x" = 20.0 }
troubles = ["current", "bias"]
[systems.mine.limits]
effort = 10.0
verdict = "offset"
[systems.mine.limits.current]
worst = 0.05
"""


def test_the_limits_of_a_system_go_before_the_general_and_those_of_a_trouble_before_both(tmp_path):
    gate = declared.read(written(tmp_path, LIMITS))
    rexrov, mine = gate.columns
    assert gate.name == "some"
    assert gate.settings.stop_time == 90.0
    assert rexrov.system == SYSTEMS["rexrov"]
    assert rexrov.left_out == ("current",)
    assert rexrov.limits == {
        "still_water": {"verdict": "held", "worst": 0.02, "effort": 50.0},
        "current": {"verdict": "held", "worst": 0.04, "effort": 50.0, "settling": 80.0},
    }
    assert mine.changes.swaps == {"rov_plant": tmp_path / "their.fmu"}
    assert mine.limits == {
        "current": {"verdict": "offset", "worst": 0.05, "effort": 10.0, "settling": 80.0},
        "bias": {"verdict": "offset", "worst": 0.02, "effort": 10.0},
    }


HEAD = 'troubles = ["still_water"]\n'
ONE = f"{HEAD}[systems.rexrov]\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("troubles = ", "This is not TOML"),
        (HEAD, "Nothing runs: write [systems.NAME] for each system, for example [systems.station_keeping]"),
        ("[systems.rexrov]", "[systems.rexrov] There are no troubles: name some, here or for all, for example"),
        (f"{HEAD}[systems.rexrow]", "[systems.rexrow] system: there is no system rexrow. Did you mean rexrov"),
        (f"{ONE}limit = 3", "[systems.rexrov] limit is unknown; expected system, swaps"),
        (f"{HEAD}stoptime = 3\n[systems.rexrov]", "stoptime is unknown; expected coupling, start_time, stop_time"),
        (f"{HEAD}timeout = 0\n[systems.rexrov]", "timeout: expected a number of seconds above 0, got 0"),
        (f"{HEAD}[systems]\nrexrov = 3", "systems.rexrov: expected a table, [systems.rexrov]"),
        ('troubles = ["currant"]\n[systems.rexrov]', "troubles: there is no trouble currant. Did you mean current"),
        ("troubles = [[1]]\n[systems.rexrov]", "troubles: expected a list of names in quotes"),
        (f'{ONE}troubles = ["bias", "bias"]', "[systems.rexrov] troubles: one stands twice"),
        (f'{ONE}without = ["bias"]', "[systems.rexrov] without: bias is none of the troubles"),
        (f'{ONE}without = ["still_water"]', "without: all troubles are in it, so that nothing runs"),
        (f'{ONE}swaps = ["a.fmu"]', "[systems.rexrov] swaps: expected a table, [swaps]"),
        (f'{ONE}map = "none.toml"', "[systems.rexrov] map: "),
        (f'{ONE}terms = "no"', "[systems.rexrov] terms: expected true, or false for a plant with our names"),
        (f'{ONE}system = "none.ssv"', "[systems.rexrov] system: "),
        (f"{ONE}[limits]\nworse = 1", "[limits] there is no score worse; expected verdict, settling"),
        (f'{ONE}[limits]\nverdict = "lost"', "[limits] verdict: expected the worst that passes, held or offset"),
        (f"{ONE}[limits]\nworst = nan", "[limits] worst: expected the largest number that passes, got nan"),
        (f"{ONE}[limits]\neffort = inf", "[limits] effort: expected the largest number that passes, got inf"),
        (f"{ONE}[limits]\nworst = -0.1", "[limits] worst is never below 0, so that none would pass at most -0.1"),
        (f"{ONE}[limits]\nworst = 20", "[limits] worst: at most 20 m says nothing; take less than 1 m"),
        (f"{ONE}[limits]\nsaturated = 1", "[limits] saturated: at most 1 says nothing; take less than 1, for it is a"),
        (f"{ONE}[limits]\ntilt = 0.8", "[limits] tilt: at most 45.84 deg says nothing; take less than 45 deg"),
        (f"{ONE}[limits.curent]\nworst = 0.1", "[limits.curent]: there is no trouble curent. Did you mean current"),
        (f"{ONE}[limits.bias]\nworst = 0.1", "[limits.bias]: the trouble is none of those that run: still_water"),
        (f"{ONE}limits = {{ still_water = {{ worst = 2 }} }}", "[systems.rexrov] [limits.still_water] worst: at most"),
    ],
)
def test_a_wrong_file_is_told_before_any_run(tmp_path, monkeypatch, text, reason):
    monkeypatch.setattr(command, "conduct", None)
    done = call("gate", written(tmp_path, text), "--output", tmp_path)
    assert done.exit_code == 1
    assert isinstance(done.exception, SystemExit)
    assert reason in done.output


def test_a_gate_is_a_file_or_one_of_this_project(tmp_path):
    assert "there is no gate quik. Did you mean quick" in one_line(call("gate", "quik"))
    assert "there is no file none.toml" in one_line(call("gate", "none.toml"))


def test_each_number_of_a_score_can_be_limited_and_what_a_run_has_not_is_beyond_any_limit():
    for name in MEASURES:
        assert problem_of(name, 0.5) == ""
        assert [one.name for one in broken(Score("held"), {"verdict": "held", name: 0.5})] == [name]
        assert [one.name for one in broken(Score("held", **{name: float("nan")}), {name: 0.5})] == [name]
        assert broken(Score("held", **{name: 0.5}), {"verdict": "held", name: 0.5}) == []
    (line,) = broken(Score("held", worst=0.034), {"worst": 0.02, "verdict": "held"})
    assert str(line) == "worst 34 mm; at most 20 mm"
    (line,) = broken(Score("offset", mean=0.01, mean_yaw=0.1), {"verdict": "held"})
    assert str(line) == "verdict offset with mean 10 mm, mean_yaw 5.73 deg; at worst held"


def test_a_released_vehicle_gets_nothing_from_its_controller_which_is_still_told_all(loop):
    free = released(loop)
    assert {link.source.element for link in loop.links} - {link.source.element for link in free.links} == {"controller"}
    assert [link for link in loop.links if link.target.element == "controller"] == [
        link for link in free.links if link.target.element == "controller"
    ]
    assert free.value("rov_plant.u[1]") == 0.0
