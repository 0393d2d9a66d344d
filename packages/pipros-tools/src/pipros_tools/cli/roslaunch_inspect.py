"""`roslaunch` options that print information about launch files: `--nodes`, `--dry-run`, …"""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence

from pipros.basics.errors import PiprosError
from pipros_tools.launch.command import CannotLaunch
from pipros_tools.launch.find_launch_files import STDIN
from pipros_tools.launch.inspect import (
    args_of_node,
    arguments_text,
    command_words,
    node_names,
    params_text,
    show_file_of_node,
)
from pipros_tools.launch.load_context import LoadContext, NotRun
from pipros_tools.launch.model import Launch, LaunchError, LaunchNode, Output
from pipros_tools.launch.xml import DEFUNCT_MASTER, load
from pipros_workspace.index import PackageIndex

Inspection = Callable[[Launch, PackageIndex], int]
"""A function that prints information about a launch, and returns the exit code."""


def inspect(show: Inspection, files: Sequence[str], arguments: Mapping[str, str], index: PackageIndex) -> int:
    """Load launch files, print information about them with `show`, and return the exit code.

    As in Noetic, `--dump-params` for a broken file exits with 0, and `--ros-args` reads only `<arg>`
    elements.
    """
    texts = [sys.stdin.read()] if STDIN in files else []
    arguments_only = show is print_arguments
    context = LoadContext.of_process(index)
    if show is print_plan:
        context = context.without_commands()
    try:
        launch = load(
            [file for file in files if file != STDIN],
            arguments,
            context=context,
            texts=texts,
            unset_as="" if arguments_only else None,
            arguments_only=arguments_only,
        )
    except PiprosError as error:
        if show is print_params:
            print(f"Unable to load file {', '.join(files)}: {error}", file=sys.stderr)
            return 0
        print(error, file=sys.stderr)
        return 1
    for warning in launch.warnings:
        if warning.startswith(DEFUNCT_MASTER):
            print(f"WARNING: {warning}", file=sys.stderr)
    return show(launch, index)


def print_nodes(launch: Launch, _index: PackageIndex) -> int:
    """Print the full names of the nodes, then of the tests, in file order (`--nodes`)."""
    for name in node_names(launch):
        print(name)
    return 0


def print_files(launch: Launch, _index: PackageIndex) -> int:
    """Print the files, including all included ones (`--files`)."""
    print("\n".join(os.path.abspath(file) for file in launch.files))
    return 0


def print_params(launch: Launch, _index: PackageIndex) -> int:
    """Print the full names and values of parameters as YAML (`--dump-params`)."""
    print(params_text(launch.params))
    return 0


def print_file_of_node(name: str, launch: Launch, _index: PackageIndex) -> int:
    """Print the file that contains a node (`--find-node`)."""
    show_file_of_node(name, launch)
    return 0


def print_node_args(name: str, files: Sequence[str], launch: Launch, index: PackageIndex) -> int:
    """Print the variables and command line of a node (`--args`). As in Noetic, only variables are quoted."""
    try:
        print(" ".join(args_of_node(name, files, launch, index)))
    except CannotLaunch as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 1
    except LaunchError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def print_arguments(launch: Launch, _index: PackageIndex) -> int:
    """Print the required and optional arguments of the files (`--ros-args`)."""
    print(arguments_text(launch.arguments))
    return 0


def print_plan(launch: Launch, index: PackageIndex) -> int:
    """Print everything that would be done, in order (`--dry-run`)."""
    for warning in launch.warnings:
        print(f"# WARNING: {warning}")
    for command in launch.commands:
        print(f"rosparam {command.action.value} {command.file} {command.key}".replace("  ", " "))
    for namespace in launch.clear_params:
        print(f"rosparam delete {namespace}")
    for key in sorted(launch.params):
        value = launch.params[key]
        shown = f'"$({value})"' if isinstance(value, NotRun) else shlex.quote(str(value))
        print(f"rosparam set {key} {shown}")
    code = 0
    for node in launch.nodes:
        print(f"\n# {node.full_name} ({node.package}/{node.type}){_traits(node)}")
        try:
            variables, argv = command_words(node, launch, index)
        except CannotLaunch as error:
            print(f"# ERROR: {error}")
            code = 1
            continue
        settings = [f"{key}={shlex.quote(value)}" for key, value in variables.items()]
        print(" ".join(["env", *settings, shlex.join(argv)]) if settings else shlex.join(argv))
    return code


def _traits(node: LaunchNode) -> str:
    traits = [name for name in ("respawn", "required") if getattr(node, name)]
    if node.machine:
        traits.append(f"on machine {node.machine}")
    traits.append(f"output to {(node.output or Output.LOG).value}")
    return ", " + ", ".join(traits) + f", from {node.place}"
