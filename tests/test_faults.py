"""What the FMUs make of misuse, fault by fault; rov_cosim/exporters/FAULTS.md tells the same."""

import re
import sys

import pytest

import faults
from rov_cosim.exporters.build import FMI3, build_fmus, components, fmu_path, project_root

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="faults.py loads the linux64 binary")


def recorded():
    """Return the cells of the page by fault and export."""
    rows = re.findall(r"^\| (.+?) \| (.*) \| (.*) \| (.*) \|$", faults.PAGE.read_text(encoding="utf-8"), re.M)
    return {fault: {"native": native, "pythonfmu": python, "system": system} for fault, native, python, system in rows}


def answered(answers):
    """Return the answers as the page has them, without those to faults that could not be committed here."""
    return {name: text.replace("*", r"\*") for name, text in answers.items() if not text.startswith("skipped")}


def status(answer):
    """Return an answer without its messages."""
    return [part.split(":")[0] for part in answer.split("; afterwards: ")]


@pytest.fixture(scope="module")
def native(fmus):
    return faults.answers(fmus, "native")


def assert_answered(answer, expected):
    if answer.startswith("skipped"):
        pytest.skip(answer)
    if expected == faults.ACCEPTED:
        assert answer == faults.ACCEPTED
    else:
        assert re.fullmatch(r"(error|discard|NULL)(: .+)?", answer)
        assert "afterwards" not in answer
        assert expected in answer


@pytest.mark.parametrize("fault", faults.FAULTS, ids=lambda fault: fault.name)
def test_the_native_export_answers_and_lives_on(native, fault):
    assert_answered(native[fault.name], fault.expected)


OWN = [fault for fault in faults.FAULTS if fault.system or fault.fails or "flipped" in fault.name]
"""Those that a system answers otherwise, and one that takes the states of all elements."""


@pytest.mark.parametrize("fault", OWN, ids=lambda fault: fault.name)
def test_a_system_answers_what_is_its_own(systems, fault):
    answer = faults.answer(systems[faults.SYSTEM], fault)
    assert_answered(answer, faults.expected(fault, faults.SYSTEM))


@pytest.mark.slow
def test_a_system_answers_all_as_the_page_tells(systems):
    answers = answered(faults.answers({faults.SYSTEM: systems[faults.SYSTEM]}, "system"))
    for fault in faults.FAULTS:
        if fault.name in answers:
            assert_answered(answers[fault.name].replace(r"\*", "*"), faults.expected(fault, faults.SYSTEM))
    page = recorded()
    assert {name: page[name]["system"] for name in answers} == answers


@pytest.fixture(scope="module")
def three():
    build_fmus(project_root(), FMI3)
    return {name: fmu_path(project_root(), name, FMI3) for name in components()}


@pytest.mark.parametrize("fault", faults.OF_THREE, ids=lambda fault: fault.name)
def test_fmi_3_answers_what_is_its_own(three, fault):
    assert_answered(faults.answer(three[fault.component], fault), fault.expected)


@pytest.mark.slow
def test_fmi_3_answers_all_as_the_page_tells(native, three):
    answers = faults.answers(three, FMI3)
    for fault in faults.FAULTS:
        if not fault.only_two:
            assert_answered(answers[fault.name], faults.expected(fault, FMI3))
    assert faults.PAGE.read_text(encoding="utf-8").endswith(faults.page_of_three(native, answers))


def test_the_page_is_current(native):
    page, answers = recorded(), answered(native)
    assert {name: page[name]["native"] for name in answers} == answers
    assert set(page) - {"fault"} == set(native)


@pytest.mark.slow
def test_the_page_tells_what_the_pythonfmu_export_answers(python_fmus):
    page, answers = recorded(), answered(faults.answers(python_fmus, "pythonfmu"))
    assert {name: status(page[name]["pythonfmu"]) for name in answers} == {n: status(a) for n, a in answers.items()}
