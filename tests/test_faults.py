"""What the FMUs make of misuse, fault by fault; rov_cosim/exporters/FAULTS.md tells the same."""

import re
import sys

import pytest

import faults
from rov_cosim.exporters.build import FMI3

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="faults.py loads the linux64 binary")


def recorded():
    """Return the cells of the page by fault and export."""
    text = faults.PAGE.read_text(encoding="utf-8")
    of_all, of_three = re.split("^## .* alone.*$", text, flags=re.M)
    rows = re.findall(r"^\| (.+?) \| (.*) \| (.*) \| (.*) \| (.*) \|$", of_all, re.M)
    table = {
        fault: dict(zip(("native", "pythonfmu", "system", faults.FMI3), cells, strict=True)) for fault, *cells in rows
    }
    alone = {fault: {faults.FMI3: answer} for fault, answer in re.findall(r"^\| (.+?) \| (.*) \|$", of_three, re.M)}
    return {name: cells for name, cells in (table | alone).items() if name != "fault"}


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


@pytest.mark.parametrize("fault", faults.OF_THREE, ids=lambda fault: fault.name)
def test_fmi_3_answers_what_is_its_own(fmi3_fmus, fault):
    assert_answered(faults.answer(fmi3_fmus[fault.component], fault), fault.expected)


@pytest.mark.slow
def test_fmi_3_answers_all_as_the_page_tells(native, fmi3_fmus):
    answers = answered(faults.answers(fmi3_fmus, FMI3))
    for fault in faults.FAULTS:
        if not fault.only_two and fault.name in answers:
            assert_answered(answers[fault.name].replace(r"\*", "*"), faults.expected(fault, FMI3))
    page, beside = recorded(), faults.beside(answered(native), answers)
    assert {name: page[name][FMI3] for name in beside} == beside


def test_the_page_is_current(native):
    page, answers = recorded(), answered(native)
    assert {name: page[name]["native"] for name in answers} == answers
    assert {name for name, cells in page.items() if "native" in cells} == set(native)
    assert set(page) - set(native) == {fault.name for fault in faults.OF_THREE}


@pytest.mark.slow
def test_the_page_tells_what_the_pythonfmu_export_answers(python_fmus):
    page, answers = recorded(), answered(faults.answers(python_fmus, "pythonfmu"))
    assert {name: status(page[name]["pythonfmu"]) for name in answers} == {n: status(a) for n, a in answers.items()}
