"""Rules about package manifests."""

from __future__ import annotations

from pipros.basics.errors import PiprosError
from pipros.health.wtf.rules import Problem, Rule, problems_of
from pipros.health.wtf.subject import Subject
from pipros.workspace.manifest import read_manifest


def manifest_valid(subject: Subject) -> list[str]:
    """Return the name of each package whose manifest cannot be read, with the error."""
    broken = []
    for name in subject.packages:
        package = subject.index.get(name)
        if package is None:
            continue
        try:
            read_manifest(package.path)
        except (PiprosError, OSError) as error:
            broken.append(f"{name}: {error}")
    return broken


errors: list[Rule] = [(manifest_valid, "The manifests of the following packages cannot be read:")]
warnings: list[Rule] = []


def check_packages(subject: Subject) -> list[Problem]:
    """Apply all rules in this module."""
    return problems_of(subject, warnings, errors)
