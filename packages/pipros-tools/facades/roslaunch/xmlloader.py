"""`XmlLoader`, which reads launch files into a `ROSLaunchConfig` or any object with its `add_…` methods."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

from pipros_tools.launch.arguments import split_arguments
from pipros_tools.launch.builder import LaunchBuilder
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import LaunchError, ParameterAction, ParameterCommand
from pipros_tools.launch.model import LaunchNode as NodeValue
from pipros_tools.launch.model import Machine as MachineValue
from pipros_tools.launch.model import Test as TestValue
from pipros_tools.launch.xml import Loader as Reader
from rosgraph.names import get_ros_namespace, is_legal_name, is_private, make_global_ns, ns_join
from roslaunch.core import PHASE_SETUP, Machine, Node, Param, RLException, RosbinExecutable, Test
from roslaunch.loader import LoadException
from roslaunch.substitution_args import ArgException, SubstitutionException

__all__ = [
    "CLEAR_PARAMS",
    "NS",
    "ArgException",
    "Machine",
    "Node",
    "Param",
    "RLException",
    "SubstitutionException",
    "Test",
    "XmlLoader",
    "XmlParseException",
    "get_ros_namespace",
    "is_legal_name",
    "is_private",
    "make_global_ns",
    "ns_join",
]

_NOT_LOADED = "error loading <rosparam> tag"
"""Prefix of errors that genuine ROS does not treat as XML errors."""

NS = "ns"
CLEAR_PARAMS = "clear_params"


class XmlParseException(RLException):
    """A launch file is invalid.

    The text contains only the reason; `places` and `element` contain the location.
    """

    def __str__(self) -> str:
        return self.reason


class _IntoConfig(LaunchBuilder):
    """Builder that passes the contents of the files to a configuration, in file order."""

    def __init__(self, config: Any, *, core: bool, verbose: bool) -> None:
        super().__init__()
        self._config = config
        self._core = core
        self._verbose = verbose

    def add_file(self, file: str) -> None:
        if self._verbose:
            print(f"... loading XML file [{file}]")
        self._config.add_roslaunch_file(file)

    def warn(self, *warnings: str) -> None:
        for warning in warnings:
            self._config.add_config_error(warning)

    def add_param(self, key: str, value: Any) -> None:
        self._config.add_param(Param(key, value), filename=None, verbose=self._verbose)

    def clear_params(self, namespace: str) -> None:
        self._config.add_clear_param(namespace)

    def add_command(self, command: ParameterCommand) -> None:
        words = (command.key,)
        if command.action is ParameterAction.DUMP:
            words = (command.file or None, command.key)  # type: ignore[assignment]
        self._config.add_executable(RosbinExecutable("rosparam", (command.action.value, *words), PHASE_SETUP))

    def add_node(self, node: NodeValue) -> None:
        self._config.add_node(Node.from_model(node), core=self._core, verbose=self._verbose)

    def add_test(self, test: TestValue) -> None:
        self._config.add_test(Test.from_test(test), verbose=self._verbose)

    def add_machine(self, machine: MachineValue) -> None:
        self._config.add_machine(Machine.from_model(machine), verbose=self._verbose)


class XmlLoader:
    """Loader that reads launch files into a configuration.

    Attributes:
        resolve_anon: has no effect, as in Noetic.
        ignore_unset_args: whether arguments without a value are treated as empty.
    """

    def __init__(self, resolve_anon: bool = True, args_only: bool = False) -> None:
        self.resolve_anon = resolve_anon
        self.args_only = args_only
        self.ignore_unset_args = False

    def load(
        self,
        filename: str,
        ros_config: Any,
        core: bool = False,
        argv: Sequence[str] | None = None,
        verbose: bool = True,
    ) -> None:
        """Read a file.

        Args:
            core: whether the file's nodes belong to the core.
            argv: `name:=value` words for the file's arguments; defaults to this process's arguments.
            verbose: whether to print each addition.

        Raises:
            XmlParseException: the file is invalid.
            LoadException: the parameters of a `<rosparam>` element cannot be loaded.
        """
        words = sys.argv if argv is None else argv
        self._read(ros_config, words, lambda reader: reader.load_file(filename), core, verbose)

    def load_string(self, xml_text: str, ros_config: Any, core: bool = False, verbose: bool = True) -> None:
        """Read a launch file that is given as a string. Raises the same errors as `load`."""
        if verbose:
            print("... loading XML")
        self._read(ros_config, sys.argv, lambda reader: reader.load_text(xml_text), core, verbose)

    def _read(
        self,
        config: Any,
        words: Sequence[str],
        read: Callable[[Reader], object],
        core: bool,
        verbose: bool,
    ) -> None:
        reader = Reader(
            LoadContext.of_process(),
            split_arguments(words)[0],
            unset_as="" if self.ignore_unset_args else None,
            arguments_only=self.args_only,
            builder=_IntoConfig(config, core=core, verbose=verbose),
        )
        try:
            read(reader)
        except XmlParseException:
            raise
        except LaunchError as error:
            kind = LoadException if error.reason.startswith(_NOT_LOADED) else XmlParseException
            raise kind(error.reason, error.places, error.element) from error
