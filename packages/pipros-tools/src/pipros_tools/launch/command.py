"""Build the command that starts a node: arguments, environment and working directory.

This module starts no processes.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from pipros.basics.env import Environment, InvalidEnvironment
from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.windows import ON_WINDOWS
from pipros.basics.words import split_words
from pipros.packages.well_known import why_not_here
from pipros_tools.launch.model import LaunchNode, Machine, WorkingFolder
from pipros_tools.launch.nodelet_choice import why_not_loadable
from pipros_tools.launch.ros2_node import ARGUMENT, ros2_arguments, why_no_rclpy
from pipros_workspace.client_library import is_here, is_ros2_script, relayed_script, without_libraries
from pipros_workspace.executables import (
    Executables,
    find_executables,
    hint_about,
    list_executables,
    package_of_programs,
    why_not_built,
)
from pipros_workspace.index import Package, PackageIndex
from pipros_workspace.program_start import command_of, environment_of, program_environment
from pipros_workspace.script_interpreter import interpreter_of


class CannotLaunch(PiprosError):
    """A node has no program, or its arguments cannot be parsed. The other nodes still start.

    Attributes:
        reason: the cause, without the node's name.
    """

    def __init__(self, reason: str, node: LaunchNode | None = None) -> None:
        self.reason = reason
        which = f"cannot launch node of type [{node.package}/{node.type}]: " if node else ""
        super().__init__(which + reason)


class CannotStart(CannotLaunch):
    """The operating system refuses to start a node's program. A launch that is still starting is aborted."""


class NodeCommand(NamedTuple):
    """A process to start.

    Attributes:
        argv: the program and its arguments.
        environment: all environment variables.
        overlay: the environment variables that the launch file and the launcher set.
        folder: the working directory.
    """

    argv: tuple[str, ...]
    environment: Mapping[str, str]
    overlay: Mapping[str, str]
    folder: Path


FindExecutables = Callable[[Package, str], Executables]


class CommandMaker:
    """Builds the commands of nodes for one environment and one set of packages."""

    def __init__(
        self,
        index: PackageIndex,
        environment: Mapping[str, str],
        ros_home: Path,
        find: FindExecutables = find_executables,
    ) -> None:
        self._index = index
        self._environment = program_environment(environment)
        self._ros_home = ros_home
        self._find = find

    @classmethod
    def for_launcher(
        cls, environment: Environment, index: PackageIndex, log: Path | None = None
    ) -> CommandMaker:
        """Create a command maker that uses this process's environment variables and `environment`'s ROS_HOME.

        Args:
            log: the launcher's log file, the value of the nodes' `ROS_LOG_FILENAME`, as in Noetic.
        """
        variables = dict(os.environ)
        if log is not None:
            variables["ROS_LOG_FILENAME"] = str(log)
        return cls(index, variables, environment.ros_home.absolute())

    @property
    def tag(self) -> str:
        """The environment variable, as `NAME=value`, that this launcher sets in all of its processes.

        Empty if the launcher has no log file.
        """
        log = self._environment.get("ROS_LOG_FILENAME")
        return f"ROS_LOG_FILENAME={log}" if log else ""

    def make(
        self,
        node: LaunchNode,
        master_uri: str,
        *,
        log_stem: str = "",
        machine: Machine | None = None,
        extra_arguments: Sequence[str] = (),
        params: Mapping[str, Any] = MappingProxyType({}),
    ) -> NodeCommand:
        """Return a node's command: prefix, program, arguments, remappings, name and log file, in this order.

        A script that imports rclpy, and not rospy, gets ROS 2's arguments instead, and its own Python.

        Args:
            params: the parameters of the launch, by full name, of which a node for rclpy gets its own.
            log_stem: the path of the node's log file without `.log`; empty for no log file.
            machine: the machine that runs the node; None for this computer.
            extra_arguments: words appended to the node's arguments.

        Raises:
            CannotLaunch: the package or the program does not exist, a quote is not closed, the nodelet
                cannot be loaded, there is no rclpy, or ROS 2 has no parameter for a value.
        """
        overlay = {"ROS_MASTER_URI": master_uri}
        if node.namespace != "/":
            overlay["ROS_NAMESPACE"] = node.namespace.rstrip("/")
        overlay.update(node.environment)
        own_arguments = [*_words(node.arguments, "arguments", node), *extra_arguments]
        arguments = [
            *own_arguments,
            *(f"{source}:={target}" for source, target in node.remappings),
            f"__name:={node.name}",
        ]
        if machine is not None:
            from pipros_tools.launch.ssh import remote_command

            argv = remote_command(machine, node, overlay, arguments)
            return NodeCommand(tuple(argv), self._environment, overlay, self._ros_home)
        if log_stem:
            arguments.append(f"__log:={log_stem}.log")
        program = self._program(node)
        is_for_ros2 = is_ros2_script(program)
        if is_for_ros2:
            source = relayed_script(program)  # whose first line may name the Python with rclpy
            program = source if os.access(source, os.X_OK) else program
            arguments = [*own_arguments, *_ros2_arguments(node, params)]
        if reason := why_not_loadable(node, {**self._environment, **overlay}):
            raise CannotLaunch(reason, node)
        prefix = _words(node.launch_prefix, "launch-prefix", node)
        folder = program.parent if node.working_folder is WorkingFolder.NODE else self._ros_home
        variables = environment_of(program, self._environment)
        if prefix or (is_for_ros2 and node.ros2_python):  # it may start another environment's Python
            variables = without_libraries(variables)
        variables = {**variables, **overlay}
        if "ROS_NAMESPACE" not in overlay:
            variables.pop("ROS_NAMESPACE", None)
        try:
            command = command_of(program, arguments, variables=variables)
            if is_for_ros2 and not prefix:
                command = _with_rclpy(command, program, node, variables)
            argv = [*prefix, *command]
        except InvalidEnvironment as error:
            raise CannotLaunch(str(error), node) from None
        return NodeCommand(tuple(argv), variables, overlay, folder)

    def _program(self, node: LaunchNode) -> Path:
        try:
            package = package_of_programs(self._index, node.package)
        except NotFound as error:
            reason = _why_not_here(node)
            # The error advises sourcing a workspace, which does not help with a well-known package.
            known = f"package [{node.package}] not found. {reason}"
            raise CannotLaunch(known if reason else str(error), node) from None
        found = self._find(package, node.type)
        reason = "" if found.runnable else why_not_built(package, node.type) or _why_not_here(node, package)
        if reason:
            raise CannotLaunch(
                f"Cannot locate node of type [{node.type}] in package [{node.package}]. {reason}", node
            )
        if not found.runnable:
            hint = hint_about(package, node.type, found)
            raise CannotLaunch(
                f"Cannot locate node of type [{node.type}] in package [{node.package}]. Make sure file "
                f"exists in package path and permission is set to executable (chmod +x)"
                + (f". {hint}" if hint else ""),
                node,
            )
        return found.runnable[0]


def _ros2_arguments(node: LaunchNode, params: Mapping[str, Any]) -> list[str]:
    try:
        return ros2_arguments(node, params)
    except ValueError as error:
        raise CannotLaunch(str(error), node) from None


def _with_rclpy(
    command: list[str], program: Path, node: LaunchNode, variables: Mapping[str, str]
) -> list[str]:
    """Return a command that runs a script for rclpy with the Python that has it."""
    if node.ros2_python:
        if shutil.which(node.ros2_python) is None:
            raise CannotLaunch(f"{ARGUMENT} names [{node.ros2_python}], which cannot be run", node)
        return [node.ros2_python, *command[command.index(str(program)) :]]
    chosen = None if ON_WINDOWS else interpreter_of(program, variables)
    is_ours = chosen is not None and chosen.interpreter is not None and is_here(chosen.interpreter)
    if (ON_WINDOWS or is_ours) and (reason := why_no_rclpy()):
        raise CannotLaunch(reason, node)
    return command


def _words(text: str, what: str, node: LaunchNode) -> list[str]:
    try:
        return split_words(text)
    except ValueError as error:
        raise CannotLaunch(
            f"the {what} [{text}] of node [{node.full_name}] cannot be parsed: {error}"
        ) from None


def _why_not_here(node: LaunchNode, package: Package | None = None) -> str | None:
    """Return advice if the node is from a well-known package, or a program that pipros leaves out.

    `package` is None if the package was not found.
    """
    programs = list_executables(package) if package else None
    return why_not_here(node.package, programs, node.type)
