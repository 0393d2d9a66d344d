"""`catkin_make run_tests`: runs the tests that packages declare, and writes the results to
`build/test_results`.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.input_file import open_file
from pipros.basics.windows import replace_file
from pipros_workspace import genuine_catkin, native_tools
from pipros_workspace.catkin.project import Download, Project, TestEntry
from pipros_workspace.cmake_runs import NativeBuildFailed
from pipros_workspace.layout import WorkspaceFolders
from pipros_workspace.make_targets import is_wanted, label, results_label
from pipros_workspace.program_start import program_environment

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
    from pipros_workspace.environment import underlays_of_build, workspace_environment

    variables = program_environment(os.environ)
    underlays = underlays_of_build(variables, layout.devel)
    return {**variables, **workspace_environment(layout.devel, underlays, variables)}


_TIMEOUT_S = 60.0
_CHUNK_BYTES = 1 << 20


def fetch(download: Download, say: Callable[[str], object]) -> None:
    """Download a file unless it already exists with the right MD5 sum. If that fails, print a warning."""
    path = Path(download.path)
    if path.is_file() and download.md5 in ("", _md5(path)):
        return
    say(f"-- Downloading {download.url} to {path}")
    unfinished = path.with_name(path.name + ".part")
    try:
        _receive(download.url, unfinished)
    except (OSError, ValueError) as error:
        say(f"-- WARNING: {download.url} cannot be downloaded: {error}")
        return
    received = _md5(unfinished)
    if download.md5 not in ("", received):
        say(f"-- WARNING: the MD5 of {download.url} must be {download.md5}, got {received}")
        unfinished.unlink()
        return
    replace_file(unfinished, path)


def _receive(url: str, file: Path) -> None:
    from urllib.error import HTTPError
    from urllib.request import urlopen

    if not url.startswith(("http://", "https://")):
        raise ValueError("the URL must begin with http:// or https://")
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        answer = urlopen(url, timeout=_TIMEOUT_S)  # noqa: S310  # checked above
    except HTTPError as refused:
        refused.close()  # the error object owns the connection
        raise
    with answer, file.open("wb") as written:
        while chunk := answer.read(_CHUNK_BYTES):
            written.write(chunk)


def _md5(path: Path) -> str:
    digest = hashlib.md5(usedforsecurity=False)
    with open_file(path) as file:
        while chunk := file.read(_CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()
