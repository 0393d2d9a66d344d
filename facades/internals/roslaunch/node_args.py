"""Command lines and names of the nodes in launch files."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.command import CannotLaunch, CommandMaker
from pipros.launch.inspect import command_words, full_node_name
from pipros.workspace.index import PackageIndex
from rosgraph.names import script_resolve_name
from roslaunch.config import load_config_default
from roslaunch.core import FileAndArguments, Machine, Node, RLException, local_machine, setup_env
from roslaunch.substitution_args import resolve_args
from roslaunch.xmlloader import XmlLoader

if TYPE_CHECKING:
    from roslaunch.config import ROSLaunchConfig

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

_star_names(
    __name__,
    "logging os rosgraph roslaunch roslaunch.substitution_args roslib rospkg shlex sys time",
)


class NodeParamsException(Exception):
    """A node's command line cannot be determined."""


def get_node_list(config: ROSLaunchConfig) -> list[str]:
    """Return the full names of the nodes and tests in a configuration."""
    return [_full_name(node) for node in (*config.nodes, *config.tests)]


def print_node_list(roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print the full names of nodes and tests. Exit with code 1 if a file is invalid."""
    for name in get_node_list(_config_or_exit(roslaunch_files)):
        print(name)


def print_node_args(node_name: str, roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print a node's command line. Exit with code 1 on failure."""
    try:
        words = get_node_args(node_name, roslaunch_files)
    except (RLException, NodeParamsException) as error:
        print(error, file=sys.stderr)
        sys.exit(1)
    print(" ".join(words))


def print_node_filename(node_name: str, roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print the file that contains a node. Exit with code 1 if a file is invalid."""
    config = _config_or_exit(roslaunch_files)
    name = full_node_name(node_name)
    found = [node for node in (*config.nodes, *config.tests) if _full_name(node) == name]
    if found:
        print(found[0].filename)
        return
    print(
        f"ERROR: cannot find node named [{name}]. Run \n\troslaunch --nodes <files>\n"
        "to see list of node names.",
        file=sys.stderr,
    )


def get_node_args(node_name: str, roslaunch_files: Sequence[FileAndArguments]) -> list[str]:
    """Return the environment variables, as `NAME="value"`, and the command line of a node.

    Raises:
        RLException: a file is invalid, or no file contains the node.
        NodeParamsException: the node's program does not exist.
    """
    config = _load(roslaunch_files)
    name = node_name if node_name.startswith("$") else full_node_name(node_name)
    found = [node for node in (*config.nodes, *config.tests) if _full_name(node) == name]
    if not found:
        known = "\n".join(f" * {node}" for node in get_node_list(config))
        files = ", ".join(file if isinstance(file, str) else file[0] for file in roslaunch_files)
        raise RLException(f"ERROR: Cannot find node named [{name}] in [{files}].\nNode names are:\n{known}")
    try:
        variables, words = command_words(
            _resolved(found[0]).to_model(), None, PackageIndex.from_environment()
        )
    except CannotLaunch as error:
        raise NodeParamsException(error.reason) from error
    return [*(f'{key}="{value}"' for key, value in variables.items()), *words]


def create_local_process_args(
    node: Node, machine: Machine, env: Mapping[str, str] | None = None
) -> list[str]:
    """Return the command line of a node on this computer, resolving `$(anon x)` in its name and arguments.

    Raises:
        ValueError: the node has no name.
        NodeParamsException: the node's program does not exist.
    """
    _ = machine
    if not node.name:
        raise ValueError("node name must be defined")
    environment = Environment.from_os(env)
    index = PackageIndex.from_environment(environment)
    maker = CommandMaker(index, dict(os.environ if env is None else env), environment.ros_home.absolute())
    try:
        command = maker.make(_resolved(node).to_model(), environment.master_uri)
    except CannotLaunch as error:
        raise NodeParamsException(error.reason) from error
    return list(command.argv)


def _resolved(node: Node) -> Node:
    context: dict[str, object] = {}
    node.name = resolve_args(node.name or "", context=context)
    node.args = resolve_args(node.args, context=context)
    return node


def _full_name(node: Node) -> str:
    return names.join(node.namespace, node.name or "")


def _load(roslaunch_files: Sequence[FileAndArguments]) -> ROSLaunchConfig:
    return load_config_default(
        roslaunch_files, None, loader=XmlLoader(resolve_anon=False), assign_machines=False
    )


def _config_or_exit(roslaunch_files: Sequence[FileAndArguments]) -> ROSLaunchConfig:
    try:
        return _load(roslaunch_files)
    except RLException as error:
        print(error, file=sys.stderr)
        sys.exit(1)
