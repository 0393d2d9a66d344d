"""Names, files and command lines of the nodes in launch files, with Noetic's names."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from pipros.basics.env import Environment
from pipros_tools.launch.command import CannotLaunch, CommandMaker
from pipros_tools.launch.inspect import args_of_node, node_names, show_file_of_node
from pipros_workspace.index import PackageIndex
from rosgraph.names import script_resolve_name
from roslaunch.config import ROSLaunchConfig, load_config_default
from roslaunch.core import FileAndArguments, Machine, Node, RLException, local_machine, setup_env

__all__ = [
    "NodeParamsException",
    "RLException",
    "create_local_process_args",
    "get_node_args",
    "get_node_list",
    "load_config_default",
    "local_machine",
    "print_node_args",
    "print_node_filename",
    "print_node_list",
    "script_resolve_name",
    "setup_env",
]

NodeParamsException = CannotLaunch
"""The program of a node was not found, or its arguments cannot be parsed."""


def get_node_list(config: ROSLaunchConfig) -> list[str]:
    """Return the full names of the nodes, then of the tests."""
    return node_names(config.to_launch())


def print_node_list(roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print the full names of the nodes in launch files, one per line."""
    print("\n".join(get_node_list(load_config_default(roslaunch_files, None))))


def print_node_args(node_name: str, roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print the result of `get_node_args`. Exit with code 1 if a file or the node's name is invalid."""
    try:
        print(" ".join(get_node_args(node_name, roslaunch_files)))
    except RLException as error:
        print(error, file=sys.stderr)
        sys.exit(1)


def print_node_filename(node_name: str, roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print the launch file that contains a node; an error if none does."""
    launch = load_config_default(roslaunch_files, None).to_launch()
    show_file_of_node(node_name, launch)


def get_node_args(node_name: str, roslaunch_files: Sequence[FileAndArguments]) -> list[str]:
    """Return the variables, as `NAME="value"`, and the command line with which a node is started.

    Raises:
        RLException: a file is invalid, or contains no node of that name.
        NodeParamsException: the node's program was not found, or its arguments cannot be parsed.
    """
    launch = load_config_default(roslaunch_files, None).to_launch()
    files = [entry if isinstance(entry, str) else entry[0] for entry in roslaunch_files]
    return args_of_node(node_name, files, launch, PackageIndex.from_environment())


def create_local_process_args(
    node: Node, machine: Machine, env: Mapping[str, str] | None = None
) -> list[str]:
    """Return the command line with which a node is started on this computer.

    Args:
        machine: accepted for compatibility; has no effect.
        env: the environment in which packages are searched for; defaults to `os.environ`.

    Raises:
        NodeParamsException: see `get_node_args`.
    """
    del machine
    variables = dict(os.environ if env is None else env)
    environment = Environment.from_os(variables)
    maker = CommandMaker(PackageIndex.from_environment(environment), variables, environment.ros_home)
    return [*maker.make(node.to_model(), environment.master_uri).argv]
