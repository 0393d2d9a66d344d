"""One check that fails does not end the others, in the doctor and in roswtf."""

from __future__ import annotations

from typing import Any

import pytest

from pipros_tools.health import graph_checks, machine_checks
from pipros_tools.health.finding import Findings, FindingSeverity, findings_of, warning
from pipros_tools.health.wtf.rules import Rule, problems_of

PLACES = pytest.mark.parametrize("place", range(3), ids=["first", "middle", "last"])


def good(report: str) -> Findings:
    yield warning("good", f"{report} is good", "")


def broken(report: str) -> Findings:
    yield warning("half", f"{report} is half done", "")
    raise ZeroDivisionError("of nothing")


@PLACES
def test_of_the_doctor(place: int) -> None:
    checks = [good, good]
    checks.insert(place, broken)
    found = findings_of(checks, "system")
    assert [each.rule for each in found].count("good") == 2
    (failed,) = (each for each in found if each.rule == "check-failed")
    assert failed.severity is FindingSeverity.ERROR
    assert failed.summary == "The check broken failed: ZeroDivisionError: of nothing"
    assert "half" in [each.rule for each in found]


@pytest.mark.parametrize(
    ("module", "check"), [(graph_checks, "check_graph"), (machine_checks, "check_machine")]
)
def test_both_parts_of_the_doctor_go_on(module: Any, check: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHECKS", (broken, good))
    assert [each.rule for each in getattr(module, check)("report")] == ["half", "check-failed", "good"]


@PLACES
def test_of_roswtf(place: int) -> None:
    def fail(_: Any) -> Any:
        raise KeyError("nothing")

    rules: list[Rule] = [(lambda _: True, "found one"), (lambda _: True, "found two")]
    rules.insert(place, (fail, "never"))

    class Subject:
        words: dict[str, str] = {}  # noqa: RUF012

    subject: Any = Subject()
    problems = problems_of(subject, rules, [])
    texts = [each.text for each in problems]
    assert texts[place] == "the rule fail failed: KeyError: 'nothing'"
    assert [text for text in texts if text.startswith("found")] == ["found one", "found two"]
    assert [each.is_error for each in problems].count(True) == 1
