"""`roswtf`: runs the checks of `pipros doctor` and of plugins, and prints the results in Noetic's format."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from pipros.basics.errors import PiprosError
from pipros.basics.names import parse_arguments
from pipros.basics.printable import printable_lines
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import add_flag, run

if TYPE_CHECKING:
    from pipros_tools.health.wtf.rules import Problem
    from pipros_tools.health.wtf.subject import Subject


class Plugins(Protocol):
    """Rules from plugins. The facade implements this interface, because plugins need the client library."""

    def load(self) -> None:
        """Find and import the plugins. Print their names, and print problems to standard error."""

    def check(self, subject: Subject) -> Sequence[Problem]:
        """Apply the static checks, or the online checks if `subject` has a running system."""
        ...


_RULE = "=" * 80


@command
def main(argv: Sequence[str] | None = None, plugins: Plugins | None = None) -> int:
    """Print all problems. Return 0 regardless of the findings, like Noetic's roswtf."""
    parser = OptionParser(
        usage="usage: roswtf [launch file]",
        prog="roswtf",
        description="roswtf is a tool for verifying a ROS installation and running system. Checks provided "
        "launchfile if provided, else current stack or package.",
    )
    add_flag(parser, "--all", dest="all_packages", help="run roswtf against all packages")
    add_flag(parser, "--no-plugins", dest="has_no_plugins", help="disable roswtf plugins")
    add_flag(parser, "--offline", dest="is_offline", help="only run offline tests")
    arguments = parse_arguments(list(sys.argv[1:] if argv is None else argv))
    options, files = parser.parse_args(list(arguments.rest))
    return run(lambda: _check(options, files, arguments.remappings, plugins))


def _check(options: Any, files: Sequence[str], arguments: Mapping[str, str], plugins: Plugins | None) -> int:
    from pipros_tools.health.wtf.rules import print_problems
    from pipros_tools.health.wtf.subject import CannotCheck

    if options.has_no_plugins:
        plugins = None
    if plugins is not None:
        plugins.load()
    try:
        subject = _subject(files, arguments)
    except CannotCheck as error:
        _print_error(str(error))
        return 0
    if options.all_packages:
        print("roswtf will run against all packages")
        subject = replace(subject, packages=tuple(package.name for package in subject.index))
    problems = _offline_problems(subject, plugins)
    print(_RULE)
    print("Static checks summary:\n")
    print_problems(problems)
    print(_RULE)
    if options.is_offline or not _has_master(subject.master_uri):
        print(
            "\nROS Master does not appear to be running.\nOnline graph checks will not be run.\n"
            f"ROS_MASTER_URI is [{subject.master_uri}]"
        )
        return 0
    problems = _online_problems(subject, plugins)
    print("\nOnline checks summary:\n")
    print_problems(problems)
    return 0


def _subject(files: Sequence[str], arguments: Mapping[str, str]) -> Subject:
    """Return what to check: launch files, the package in the working directory, or only the environment."""
    from pipros_tools.health.wtf.subject import Subject

    subject = Subject.from_variables()
    if files:
        return subject.with_launch_files(files, arguments)
    package = subject.index.containing(Path.cwd())
    if package is None or subject.index.get(package.name) is None:
        print("No package or stack in the current directory")
        return subject
    print(f"Package: {package.name}")
    return subject.with_package(package.name)


def _offline_problems(subject: Subject, plugins: Plugins | None) -> list[Problem]:
    from pipros_tools.health.gather_machine import gather_machine
    from pipros_tools.health.machine_checks import check_machine
    from pipros_tools.health.wtf.launch import check_launch_files, check_packages
    from pipros_tools.health.wtf.rules import as_problems

    machine = replace(gather_machine(subject.variables), master_error=None)  # the online checks need a master
    return [
        *as_problems(check_machine(machine)),
        *check_packages(subject),
        *check_launch_files(subject),
        *(plugins.check(subject) if plugins else ()),
    ]


def _online_problems(subject: Subject, plugins: Plugins | None) -> list[Problem]:
    from pipros_tools.health.wtf.graph import check_graph, with_running_system
    from pipros_tools.health.wtf.launch import check_launchers

    print("Beginning tests of your ROS graph. These may take a while...")
    print("analyzing graph...", flush=True)
    subject = with_running_system(subject, _print_error)
    print("... done analyzing graph\nrunning graph rules...", flush=True)
    problems = check_graph(subject)
    print("... done running graph rules")
    problems += check_launchers(subject)
    return [*problems, *(plugins.check(subject) if plugins else ())]


def _has_master(uri: str) -> bool:
    from pipros.net.master_client import MasterClient

    try:
        client = MasterClient(uri, "/roswtf", timeout_s=5.0)
        client.get_pid()
        client.close()
    except (PiprosError, ValueError):
        return False
    return True


def _print_error(text: str) -> None:
    print(printable_lines(text), file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
