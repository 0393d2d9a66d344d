"""`catkin_make` targets, and catkin's names for test results."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence

from pipros_workspace.catkin.project import Project, TestEntry

_ALWAYS = (
    "all", "clean", "clean_test_results", "cmake_check_build_system", "download_extra_data", "help",
    "install", "run_tests", "test", "tests",
)  # fmt: skip
_KINDS = {"python": "nosetests", "roslaunch": "roslaunch-check"}


def names(projects: Mapping[str, Project]) -> Iterator[str]:
    """Yield the names of all targets in a workspace."""
    yield from _ALWAYS
    for name, project in projects.items():
        # make accepts a package name, because a folder of that name exists and counts as up to date
        yield from (name, f"run_tests_{name}", f"clean_test_results_{name}")
        yield from project.targets
        for test in project.tests:
            yield from _names_of(test, name)


def is_wanted(test: TestEntry, package: str, targets: Sequence[str]) -> bool:
    """Return whether a test belongs to one of the targets."""
    names_of_it = {"test", "run_tests", f"run_tests_{package}", *_names_of(test, package)}
    return not names_of_it.isdisjoint(targets)


def _names_of(test: TestEntry, package: str) -> Iterator[str]:
    kind = _KINDS.get(test.kind, test.kind)
    yield f"run_tests_{package}_{kind}"
    yield f"run_tests_{package}_{kind}_{label(test)}"


def label(test: TestEntry) -> str:
    """Return a test's name: its target, or its path with the slashes replaced.

    The name of a test with arguments is its file name with the arguments, so that a file can be listed
    several times with different arguments.
    """
    if test.kind == "gtest":
        return test.target
    if test.kind == "python":
        return test.written.replace("/", ".")
    written = test.written
    arguments = [word for word in test.arguments if not word.startswith("-")]
    if arguments:
        stem, extension = os.path.splitext(os.path.basename(written))
        written = "__".join([stem, *(word.replace(":=", "_") for word in arguments)]) + extension
    return written.replace("/", "_")


def results_label(test: TestEntry) -> str:
    """Return the name for a launch file's results: its label up to the first dot, as in catkin."""
    return label(test).partition(".")[0]
