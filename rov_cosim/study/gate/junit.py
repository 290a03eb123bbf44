"""A gate as JUnit's XML, which CI servers read."""

from pathlib import Path

from junitparser import Failure, JUnitXml, Skipped, TestCase, TestSuite

from .conduct import Outcome
from .page import kept


def write(outcome: Outcome, path: Path) -> None:
    """Write a suite for each system with a case for each trouble, and the faults of its loop as one more."""
    suites = JUnitXml(f"gate {outcome.name}")
    for system in dict.fromkeys(cell.system for cell in outcome.results):
        suite = TestSuite(system)
        for element, fmu in outcome.fmus.get(system, {}).items():
            suite.add_property(element, fmu)
        for cell, result in outcome.results.items():
            if cell.system == system:
                case = TestCase(cell.trouble, f"{outcome.name}.{system}")
                said = "\n".join(result.reasons)
                if result.status == "red":
                    case.result = [Failure(said)]
                elif result.status == "left out":
                    case.result = [Skipped(said)]
                case.system_out = kept(result)
                suite.add_testcase(case)
        if faults := outcome.faults.get(system):
            case = TestCase("signs", f"{outcome.name}.{system}")
            case.result = [Failure("\n".join(faults))]
            suite.add_testcase(case)
        suites.add_testsuite(suite)
    suites.write(str(path), pretty=True)
