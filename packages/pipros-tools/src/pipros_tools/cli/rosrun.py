"""`rosrun`: finds a program by package and name, and replaces its own process with it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from pipros.basics.errors import NotFound
from pipros.basics.graph_variables import InvalidEnvironment
from pipros.basics.input_file import open_file
from pipros.basics.interrupts import ENDING_SIGNALS, forget_handlers
from pipros.basics.windows import ON_WINDOWS
from pipros_tools.cli.entry_point import command
from pipros_workspace.executables import (
    Executables,
    find_executables,
    hint_about,
    list_executables,
    package_of_programs,
    why_not_built,
)
from pipros_workspace.index import Package, PackageIndex
from pipros_workspace.program_start import command_of, environment_of, why_not_startable
from pipros_workspace.python2 import python2_advice

USAGE = """\
Usage: rosrun [--prefix cmd] [--debug] PACKAGE EXECUTABLE [ARGS]
  rosrun will locate PACKAGE and try to find
  an executable named EXECUTABLE in the PACKAGE tree.
  If it finds it, it will run it with ARGS."""

# Exit codes of Noetic's rosrun. The last two are a shell's exit codes for programs that cannot be run.
UNKNOWN_PACKAGE = 2
NOT_FOUND = 3
CANNOT_RUN = 126
NO_SUCH_COMMAND = 127


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Replace this process with the program. Return an exit code only if no program can be run.

    On Windows, run the program as a child process, and return its exit code.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    prefix, debug = "", False
    while arguments and arguments[0] in ("--prefix", "--debug", "-d", "-h", "--help"):
        option = arguments.pop(0)
        if option in ("--debug", "-d"):
            debug = True
        elif option == "--prefix" and arguments:
            prefix = arguments.pop(0)
        else:
            arguments = []
    if len(arguments) < 2:
        print(USAGE)
        return 0
    package_name, name, *rest = arguments
    if package_name.startswith("-"):
        print(f"[rosrun] Error: unknown option {package_name}\n{USAGE}", file=sys.stderr)
        return UNKNOWN_PACKAGE

    index = PackageIndex.from_environment()
    try:
        package = package_of_programs(index, package_name)
    except NotFound:
        print(f"[rospack] Error: package '{package_name}' not found", file=sys.stderr)
        if not _print_advice(package_name):
            _suggest(package_name, [package.name for package in index])
            if index.advice:
                print(f"[rosrun] {index.advice}", file=sys.stderr)
        return UNKNOWN_PACKAGE
    found = find_executables(package, name)
    if debug:
        _print_search(found, name)
    program = _choose(found)
    if program is None:
        if found.runnable:
            return NO_SUCH_COMMAND
        programs = list_executables(package)
        _report_missing_program(package, name, found)
        if reason := why_not_built(package, name):
            print(f"[rosrun] {reason}", file=sys.stderr)
        else:
            _print_advice(package_name, programs, name)
        return NOT_FOUND
    environment = environment_of(program, os.environ)
    try:
        command = command_of(program, rest, prefix, environment)
    except InvalidEnvironment as error:
        print(f"[rosrun] {error}", file=sys.stderr)
        return CANNOT_RUN
    except ValueError as error:
        print(f"[rosrun] the prefix [{prefix}] is not a valid command: {error}", file=sys.stderr)
        return CANNOT_RUN
    if debug:
        print(f"[rosrun] Running {prefix} {' '.join([str(program), *rest])}")
    return _run(program, command, environment)


def _choose(found: Executables) -> Path | None:
    """Return the program to run, or None if there is none or the user chooses none.

    If there are several, ask the user, unless one is a devel-space relay for the other.
    """
    if len(found.runnable) <= 1 or found.relay:
        return found.runnable[0] if found.runnable else None
    print("[rosrun] You have chosen a non-unique executable, please pick one of the following:")
    for number, path in enumerate(found.runnable, 1):
        print(f"{number}) {path}", file=sys.stderr)
    print("#? ", end="", file=sys.stderr, flush=True)
    answer = sys.stdin.readline().strip()
    if answer.isdecimal() and 1 <= int(answer) <= len(found.runnable):
        return found.runnable[int(answer) - 1]
    print(f"[rosrun] [{answer}] is not one of these numbers; no program was run", file=sys.stderr)
    return None


def _run(program: Path, command: list[str], environment: dict[str, str]) -> int:
    # The operating system's error for a script with a bad shebang is unhelpful.
    reason = why_not_startable(program, environment) if command[0] == str(program) else None
    if reason is not None:
        print(f"[rosrun] {reason}", file=sys.stderr)
        with open_file(program) as file:
            names_interpreter = file.read(2) == b"#!"
        return NO_SUCH_COMMAND if names_interpreter else CANNOT_RUN
    advice = python2_advice(program)
    if advice is not None:
        print(f"[rosrun] {advice}", file=sys.stderr)
    sys.stdout.flush()
    try:
        if ON_WINDOWS:
            return _run_and_wait(command, environment)
        _replace_process(command, environment)
    except OSError as error:
        print(f"[rosrun] {command[0]}: {error.strerror}", file=sys.stderr)
        return NO_SUCH_COMMAND if isinstance(error, FileNotFoundError) else CANNOT_RUN


def _run_and_wait(command: list[str], environment: dict[str, str]) -> int:
    """Run a program as a child process, on systems where it cannot replace this process.

    Both processes receive Ctrl-C. This process ignores it, so that the program decides when to exit. If this
    process is killed, the program ends, too.
    """
    import contextlib
    import signal
    import subprocess

    from pipros.basics.windows_job import Job

    for number in ENDING_SIGNALS:
        signal.signal(number, lambda *_: None)
    program = subprocess.Popen(command, env=environment)  # noqa: S603
    with contextlib.suppress(OSError):
        Job(program.pid)  # it is closed when this process ends
    return program.wait()


def _replace_process(command: list[str], environment: dict[str, str]) -> NoReturn:
    forget_handlers()
    os.execvpe(command[0], command, environment)  # noqa: S606


def _print_search(found: Executables, name: str) -> None:
    *builds, place = found.searched
    print("[rosrun] Looking in catkin libexec dirs: ")
    print("\n".join(str(folder) for folder in builds))
    print(f"[rosrun] Looking in rospack dir: {place}")
    print(f"[rosrun] Searching for {name} with permissions /111")
    if found.relay:
        print(f"[rosrun] Assuming {found.relay} is a devel-space relay for {found.runnable[1]}")


def _print_advice(package: str, programs: Sequence[str] | None = None, program: str = "") -> bool:
    """Print how to get a well-known package or program; return False if there is no advice.

    Write to stderr, so that stdout equals Noetic's.
    """
    from pipros.packages.well_known import why_not_here

    reason = why_not_here(package, programs, program)
    if reason:
        print(f"[rosrun] {reason}", file=sys.stderr)
    return reason is not None


def _report_missing_program(package: Package, name: str, found: Executables) -> None:
    if "/" in name:
        print(f"[rosrun] Couldn't find executable named {package.path / name}")
    else:
        print(f"[rosrun] Couldn't find executable named {name} below {package.path}")
    if found.unusable:
        print("[rosrun] Found the following, but they're either not files,\n[rosrun] or not executable:")
        for path in found.unusable:
            print(f"[rosrun]   {path}")
    elif hint := hint_about(package, name, found):
        print(f"[rosrun] {hint}", file=sys.stderr)  # so that stdout equals Noetic's


def _suggest(name: str, known: list[str]) -> None:
    """Suggest names similar to a mistyped name, on stderr, so that stdout equals Noetic's."""
    from pipros.basics.similar_names import similar_names

    if question := similar_names(name, known):
        print(f"[rosrun] {question}", file=sys.stderr)
