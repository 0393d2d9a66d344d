"""`catkin_make run_tests`: runs the tests that packages declare, and writes the results to
`build/test_results`.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.workspace import genuine_catkin, native_tools
from pipros.workspace.catkin.project import Project, TestEntry
from pipros.workspace.cmake_runs import NativeBuildFailed
from pipros.workspace.downloads import fetch
from pipros.workspace.layout import WorkspaceFolders
from pipros.workspace.make_targets import is_wanted, label, results_label
from pipros.workspace.program_start import program_environment

if TYPE_CHECKING:
    from pipros.basics.printable import Say


LeaveError = Callable[[Path, str, str], None]
"""Callback that receives the result file to write, the name of the test, and the error."""


def run_tests(
    projects: Mapping[str, Project],
    layout: WorkspaceFolders,
    targets: Sequence[str],
    say: Say,
    leave_error: LeaveError,
    script_runner: Sequence[str],
) -> None:
    """Run tests one after another. As in Noetic, failures are only reported later, by `catkin_test_results`.

    Args:
        targets: the `catkin_make` targets, such as `run_tests`.
        say: called with each text to print.
        leave_error: called if a test cannot be compiled; must write a result file with the reason.
        script_runner: command that runs a Python test if pytest is not installed. Its arguments are the
            script and the result file.
    """
    results = layout.build / "test_results"
    environment = _environment(layout)
    for name, project in projects.items():
        wanted = [test for test in project.tests if is_wanted(test, name, targets)]
        for download in project.downloads if wanted else ():
            fetch(download, say)
        for test in wanted:
            (results / name).mkdir(parents=True, exist_ok=True)
            try:
                _compile(test, project, layout)
            except (native_tools.MissingTools, NativeBuildFailed) as error:
                say(str(error))
                leave_error(results / name / f"gtest-{test.target}.xml", test.target, str(error))
                continue
            command = _command(test, project, layout, str(results), script_runner)
            say(f"-- run_tests.py: execute command\n  {' '.join(command)}")
            subprocess.run(command, cwd=layout.build, env=environment, check=False)  # noqa: S603


def _compile(test: TestEntry, project: Project, layout: WorkspaceFolders) -> None:
    """Build a test's program with genuine catkin, if the program must be compiled.

    Raises:
        MissingTools, NativeBuildFailed: the program cannot be compiled.
    """
    if not test.target:
        return
    if not project.needs_cmake:
        raise native_tools.MissingTools(
            f"{test.place}: the test [{test.target}] of the package [{project.name}] must be compiled. "
            "Install CMake, a C++ compiler and genuine catkin"
        )
    genuine_catkin.make(layout, test.target)


def _command(
    test: TestEntry, project: Project, layout: WorkspaceFolders, results: str, script_runner: Sequence[str]
) -> list[str]:
    programs = os.path.dirname(sys.executable)
    if test.kind == "rostest":
        return [
            os.path.join(programs, "rostest"),
            f"--pkgdir={project.folder}",
            f"--package={project.name}",
            f"--results-filename={results_label(test)}.xml",
            f"--results-base-dir={results}",
            test.path,
            *test.arguments,
        ]
    if test.kind == "roslaunch":
        output = os.path.join(results, project.name, f"roslaunch-check_{label(test)}.xml")
        return [os.path.join(programs, "roslaunch-check"), "-o", output, test.path, *test.arguments]
    if test.kind == "gtest":
        output = os.path.join(results, project.name, f"gtest-{test.target}.xml")
        return [str(layout.devel / "lib" / project.name / test.target), f"--gtest_output=xml:{output}"]
    output = os.path.join(results, project.name, f"nosetests-{label(test)}.xml")
    if importlib.util.find_spec("pytest"):
        return [sys.executable, "-m", "pytest", test.path, f"--junitxml={output}"]
    return [*script_runner, test.path, output]


def _environment(layout: WorkspaceFolders) -> dict[str, str]:
    """Return the environment with the workspace set up, as if `devel/setup.sh` had been sourced."""
    from pipros.workspace.environment import underlays_of_build, workspace_environment

    variables = program_environment(os.environ)
    underlays = underlays_of_build(variables, layout.devel)
    return {**variables, **workspace_environment(layout.devel, underlays, variables)}
