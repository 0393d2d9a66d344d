"""`catkin_make run_tests`: runs the tests that packages list; results are left in `build/test_results`."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence

from pipros.workspace.interpreter import with_own_python_first
from pipros.workspace.layout import Layout
from pipros.workspace.project import Project, TestEntry


def run_tests(
    projects: Mapping[str, Project], layout: Layout, targets: Sequence[str], say: Callable[[str], None]
) -> None:
    """Runs tests one after another; failures are for `catkin_test_results` to report, as in Noetic."""
    results = layout.build / "test_results"
    for name, project in projects.items():
        if not {"run_tests", "test"} & set(targets) and f"run_tests_{name}" not in targets:
            continue
        for test in project.tests:
            command = _command(test, project, str(results))
            say(f"-- run_tests.py: execute command\n  {' '.join(command)}")
            (results / name).mkdir(parents=True, exist_ok=True)
            subprocess.run(  # noqa: S603
                command, cwd=layout.build, env=_environment(layout), check=False
            )


def _command(test: TestEntry, project: Project, results: str) -> list[str]:
    label = _label(test, project)
    if test.kind == "rostest":
        stem = os.path.splitext(label)[0]
        return [
            os.path.join(os.path.dirname(sys.executable), "rostest"),
            f"--pkgdir={project.folder}",
            f"--package={project.name}",
            f"--results-filename={stem}.xml",
            f"--results-base-dir={results}",
            test.path,
            *test.arguments,
        ]
    if test.kind == "roslaunch":
        output = os.path.join(results, project.name, f"roslaunch-check_{label}.xml")
        return [sys.executable, "-m", "pipros.cli.roslaunch_check", "-o", output, test.path, *test.arguments]
    output = os.path.join(results, project.name, f"nosetests-{label}.xml")
    if importlib.util.find_spec("pytest"):
        return [sys.executable, "-m", "pytest", test.path, f"--junitxml={output}"]
    return [sys.executable, "-m", "pipros.testing.unittests", test.path, output]


def _label(test: TestEntry, project: Project) -> str:
    """The test's name among the results: its path, or its file with its arguments when it has any.

    So that one file may be listed more than once, with different arguments.
    """
    inside = os.path.relpath(test.path, project.folder)
    arguments = [word for word in test.arguments if "=" in word]
    if arguments:
        stem, extension = os.path.splitext(os.path.basename(inside))
        words = [word.replace(":=", "_").replace("=", "_") for word in arguments]
        inside = "__".join([stem, *words]) + extension
    return inside.replace(os.sep, "_").replace(":", "_")


def _environment(layout: Layout) -> dict[str, str]:
    """The environment with the workspace set up, as if `devel/setup.sh` had been sourced."""
    from pipros.workspace.environment import underlays_of_build, workspace_environment

    variables = with_own_python_first(os.environ)
    underlays = underlays_of_build(variables, layout.devel)
    return {**variables, **workspace_environment(layout.devel, underlays, variables)}
