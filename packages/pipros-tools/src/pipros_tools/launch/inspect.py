"""List the nodes, arguments, parameters and node commands in launch files, without starting nodes."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pipros.basics import names
from pipros.basics.env import Environment
from pipros_tools.launch.command import CommandMaker
from pipros_tools.launch.model import Argument, Launch, LaunchError, LaunchNode
from pipros_workspace.index import PackageIndex


def node_names(launch: Launch) -> list[str]:
    """Return the full names of the nodes, then of the tests, in file order."""
    return [node.full_name for node in (*launch.nodes, *(test.node for test in launch.tests))]


def full_node_name(name: str) -> str:
    """Resolve a node name from a command line to its full name."""
    return names.canonicalize(names.resolve(name, "/roslaunch"))


def command_words(node: LaunchNode, launch: Launch, index: PackageIndex) -> tuple[dict[str, str], list[str]]:
    """Return the environment variables that a launch sets for its node, and the node's command line.

    The variables do not include ROS_MASTER_URI.

    Raises:
        CannotLaunch: the node's program was not found, or its arguments cannot be parsed.
    """
    environment = Environment.from_os()
    command = CommandMaker.for_launcher(environment, index).make(
        node, environment.master_uri, machine=launch.machines.get(node.machine), params=launch.params
    )
    overlay = {key: value for key, value in command.overlay.items() if key != "ROS_MASTER_URI"}
    return overlay, list(command.argv)


def args_of_node(name: str, files: Sequence[str], launch: Launch, index: PackageIndex) -> list[str]:
    """Return the variables and the command line of a node. As in Noetic, only variables are quoted.

    Raises:
        LaunchError: there is no node of that name.
        CannotLaunch: see `command_words`.
    """
    name = full_node_name(name)
    node = launch.node(name)
    if node is None:
        known = "\n".join(f" * {each}" for each in node_names(launch))
        where = ", ".join(files)
        raise LaunchError(f"ERROR: Cannot find node named [{name}] in [{where}].\nNode names are:\n{known}")
    variables, argv = command_words(node, launch, index)
    # The characters that are special within double quotes in a shell are escaped.
    quoted = (re.sub(r'(["$`\\])', r"\\\1", value) for value in variables.values())
    return [*(f'{key}="{value}"' for key, value in zip(variables, quoted, strict=True)), *argv]


def show_file_of_node(name: str, launch: Launch) -> None:
    """Print the file that contains a node; an error if none does."""
    name = full_node_name(name)
    node = launch.node(name)
    if node is None or node.place is None:
        advice = "Run \n\troslaunch --nodes <files>\nto see list of node names."
        print(f"ERROR: cannot find node named [{name}]. {advice}", file=sys.stderr)
    else:
        print(node.place.file)


def params_text(params: Mapping[str, Any]) -> str:
    """Format the full names and values of parameters as YAML."""
    import yaml

    return yaml.safe_dump(dict(params), default_flow_style=False, allow_unicode=True)


def arguments_text(arguments: Iterable[Argument]) -> str:
    """List the required and optional arguments of files, as printed by `--ros-args`.

    As in Noetic, an argument with an empty default is listed as required.
    """
    declared = sorted(
        (argument for argument in arguments if not argument.value), key=lambda argument: argument.name
    )
    lines = []
    if required := [argument for argument in declared if not argument.default]:
        lines += [
            "Required Arguments:",
            *(f"  {argument.name}: {argument.doc or 'undocumented'}" for argument in required),
        ]
    if optional := [argument for argument in declared if argument.default]:
        lines += ["Optional Arguments:"]
        lines += [
            f'  {argument.name} (default "{argument.default}"): {argument.doc or "undocumented"}'
            for argument in optional
        ]
    return "\n".join(lines or ["No arguments."])
