"""`roslaunch.node_args`: the command line of a node."""

from __future__ import annotations

import os
from collections.abc import Mapping

from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.command import CannotLaunch, CommandMaker
from pipros.workspace.index import PackageIndex
from rosgraph.names import script_resolve_name
from roslaunch.config import load_config_default
from roslaunch.core import Machine, Node, RLException, local_machine, setup_env
from roslaunch.substitution_args import resolve_args

__all__ = [
    "NodeParamsException",
    "RLException",
    "create_local_process_args",
    "load_config_default",
    "local_machine",
    "script_resolve_name",
    "setup_env",
]

_star_names(
    __name__,
    "logging os rosgraph roslaunch roslaunch.substitution_args roslib rospkg shlex sys time",
)


class NodeParamsException(Exception):
    """A node's command line cannot be determined."""


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
    context: dict[str, object] = {}
    node.name = resolve_args(node.name, context=context)
    node.args = resolve_args(node.args, context=context)
    environment = Environment.from_os(env)
    index = PackageIndex.from_environment(environment)
    maker = CommandMaker(index, dict(os.environ if env is None else env), environment.ros_home.absolute())
    try:
        command = maker.make(node.to_model(), environment.master_uri)
    except CannotLaunch as error:
        raise NodeParamsException(error.reason) from error
    return list(command.argv)
