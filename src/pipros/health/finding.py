"""`Finding`, a problem found by a health check."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any


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


def has_errors(findings: Iterable[Finding]) -> bool:
    return any(finding.severity is FindingSeverity.ERROR for finding in findings)
