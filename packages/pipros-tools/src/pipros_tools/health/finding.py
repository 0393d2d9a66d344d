"""`Finding`, a problem found by a health check."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeVar

from pipros.basics.printable import printable

Report = TypeVar("Report")


class FindingSeverity(Enum):
    """Severity of a finding.

    An error means that something does not work. The cause of a warning may be intentional.
    """

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True, slots=True)
class Finding:
    """One problem.

    Attributes:
        rule: the machine-readable name of the check, such as `ghost-node`.
        severity: error or warning.
        summary: the problem in one sentence, with names and values.
        cure: advice for the user.
        subjects: the nodes, topics, services or variables concerned.
    """

    rule: str
    severity: FindingSeverity
    summary: str
    cure: str
    subjects: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        return {
            "rule": self.rule,
            "severity": self.severity.value,
            "summary": self.summary,
            "cure": self.cure,
            "subjects": list(self.subjects),
        }


Findings = Iterator[Finding]
"""Result of a check."""


def error(rule: str, summary: str, cure: str, *subjects: str) -> Finding:
    return Finding(rule, FindingSeverity.ERROR, summary, cure, subjects)


def warning(rule: str, summary: str, cure: str, *subjects: str) -> Finding:
    return Finding(rule, FindingSeverity.WARNING, summary, cure, subjects)


def findings_of(checks: Iterable[Callable[[Report], Findings]], report: Report) -> list[Finding]:
    """Run all checks and return the findings, in the order of the checks.

    A check that raises an exception, such as that of a plugin, does not end the others.
    """
    found: list[Finding] = []
    for check in checks:
        try:
            found.extend(check(report))
        except Exception as problem:
            name = getattr(check, "__name__", repr(check))
            found.append(
                error(
                    "check-failed",
                    f"The check {name} failed: {type(problem).__name__}: {printable(problem)}",
                    "Its findings are missing here. Report this error to the authors of the check.",
                    name,
                )
            )
    return found


def has_errors(findings: Iterable[Finding]) -> bool:
    return any(finding.severity is FindingSeverity.ERROR for finding in findings)
