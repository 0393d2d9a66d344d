"""`XmlLoader`, which reads launch files into a `ROSLaunchConfig` or any object with its `add_…` methods."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.arguments import split_arguments
from pipros.launch.builder import LaunchBuilder
from pipros.launch.load_context import LoadContext
from pipros.launch.model import Argument, LaunchError, ParameterAction, ParameterCommand
from pipros.launch.model import Machine as MachineValue
from pipros.launch.model import Node as NodeValue
from pipros.launch.model import Test as TestValue
from pipros.launch.param_types import convert_bool
from pipros.launch.scope import LaunchScope
from pipros.launch.xml import Loader as Reader
from rosgraph.names import get_ros_namespace, is_legal_name, is_private, make_global_ns, ns_join
from roslaunch.core import PHASE_SETUP, Machine, Node, Param, RLException, RosbinExecutable, Test
from roslaunch.loader import Loader, LoaderContext, LoadException
from roslaunch.substitution_args import ArgException, SubstitutionException, resolve_args

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
    "ifunless",
    "ifunless_test",
    "is_legal_name",
    "is_private",
    "make_global_ns",
    "ns_join",
]

_star_names(
    __name__,
    "DomNode=xml.dom:Node itertools logging xml.dom.minidom:parse xml.dom.minidom:parseString "
    "rospkg.common:ResourceNotFound roslaunch.loader roslaunch.substitution_args sys traceback",
)

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


def _context_of(scope: LaunchScope, filename: str | None, declared: Sequence[Argument]) -> LoaderContext:
    context = LoaderContext(scope.namespace, filename, arg_names=sorted(scope.declared))
    context.resolve_dict["arg"] = {
        name: value for name, value in scope.arguments.items() if value is not None
    }
    context.resolve_dict["arg_doc"] = {
        argument.name: (argument.doc or None, argument.default) for argument in declared if not argument.value
    }
    return context


class DomElement(Protocol):
    """The part of the `xml.dom` element interface that the loader uses."""

    def getAttribute(self, name: str) -> str: ...

    def hasAttribute(self, name: str) -> bool: ...


def ifunless_test(obj: XmlLoader, tag: DomElement, context: LoaderContext) -> bool:
    """Evaluate the `if` or `unless` attribute of an element. Return True if it has neither.

    Raises:
        XmlParseException: the element has both, or a value is neither true nor false.
    """
    wanted, unwanted = obj.opt_attrs(tag, context, ("if", "unless"))
    if wanted is not None and unwanted is not None:
        raise XmlParseException("cannot set both 'if' and 'unless' on the same tag")
    try:
        if wanted is not None:
            return convert_bool(wanted)
        return unwanted is None or not convert_bool(unwanted)
    except ValueError as error:
        raise XmlParseException(str(error)) from error


def ifunless(f: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a loader method so that it ignores elements excluded by `if` or `unless`."""

    def call(*args: Any, **kwds: Any) -> Any:
        return f(*args, **kwds) if ifunless_test(args[0], args[1], args[2]) else None

    return call


class _IntoConfig(LaunchBuilder):
    """Builder that passes the contents of the files to a configuration, in file order."""

    def __init__(self, config: Any, *, core: bool, verbose: bool) -> None:
        super().__init__()
        self._config = config
        self._core = core
        self._verbose = verbose
        self.arguments: list[Argument] = []

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

    def add_argument(self, argument: Argument) -> None:
        self.arguments.append(argument)


class XmlLoader(Loader):
    """Loader that reads launch files into a configuration.

    Attributes:
        resolve_anon: has no effect, as in Noetic.
        root_context: the context of the latest file, with its arguments; None before the first file.
        ignore_unset_args: whether arguments without a value are treated as empty.
    """

    NODE_ATTRS = (
        "pkg", "type", "machine", "name", "args", "output", "respawn", "respawn_delay", "cwd", NS,
        CLEAR_PARAMS, "launch-prefix", "required",
    )  # fmt: skip
    TEST_ATTRS = (
        "pkg", "type", "machine", "name", "args", "output", "respawn", "respawn_delay", "cwd", NS,
        CLEAR_PARAMS, "launch-prefix", "required", "test-name", "time-limit", "retry",
    )  # fmt: skip
    MACHINE_ATTRS = (
        "name", "address", "env-loader", "ssh-port", "user", "password", "default", "timeout",
    )  # fmt: skip
    PARAM_ATTRS = ("name", "value", "type", "value", "textfile", "binfile", "command")
    ROSPARAM_OPT_ATTRS = ("command", "ns", "file", "param", "subst_value")
    GROUP_ATTRS = (NS, CLEAR_PARAMS)
    INCLUDE_ATTRS = ("file", NS, CLEAR_PARAMS, "pass_all_args")
    REMAP_ATTRS = ("from", "to")
    ENV_ATTRS = ("name", "value")
    ARG_ATTRS = ("name", "value", "default", "doc")

    def __init__(self, resolve_anon: bool = True, args_only: bool = False) -> None:
        self.resolve_anon = resolve_anon
        self.args_only = args_only
        self.ignore_unset_args = False
        self.root_context: LoaderContext | None = None

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
            XmlParseException: the file is invalid. The message names the file, line and element.
        """
        words = sys.argv if argv is None else argv
        self._read(ros_config, words, filename, lambda reader: reader.load_file(filename), core, verbose)

    def load_string(self, xml_text: str, ros_config: Any, core: bool = False, verbose: bool = True) -> None:
        """Read a launch file that is given as a string. Raises the same errors as `load`."""
        if verbose:
            print("... loading XML")
        self._read(ros_config, sys.argv, None, lambda reader: reader.load_text(xml_text), core, verbose)

    def _read(
        self,
        config: Any,
        words: Sequence[str],
        filename: str | None,
        read: Callable[[Reader], LaunchScope],
        core: bool,
        verbose: bool,
    ) -> None:
        builder = _IntoConfig(config, core=core, verbose=verbose)
        reader = Reader(
            LoadContext.of_process(),
            split_arguments(words)[0],
            unset_as="" if self.ignore_unset_args else None,
            arguments_only=self.args_only,
            builder=builder,
        )
        try:
            scope = read(reader)
        except XmlParseException:
            raise
        except LaunchError as error:
            kind = LoadException if error.reason.startswith(_NOT_LOADED) else XmlParseException
            raise kind(error.reason, error.places, error.element) from error
        self.root_context = _context_of(scope, filename, builder.arguments)

    def resolve_args(self, args: str, context: LoaderContext) -> str:
        """Return the text with all substitutions applied in a context.

        Raises:
            ArgException: an argument is not set.
            XmlParseException: the text is malformed or contains an unresolvable reference.
        """
        context.resolve_dict["filename"] = context.filename
        try:
            return resolve_args(args, context=context.resolve_dict, resolve_anon=self.resolve_anon)
        except ArgException:
            if not self.ignore_unset_args:
                raise
            return ""
        except SubstitutionException as error:
            raise XmlParseException(str(error)) from error

    def opt_attrs(self, tag: DomElement, context: LoaderContext, attrs: Sequence[str]) -> list[str | None]:
        """Return the values of attributes in a context. Missing attributes are None."""
        return [
            self.resolve_args(tag.getAttribute(name), context) if tag.hasAttribute(name) else None
            for name in attrs
        ]

    def reqd_attrs(self, tag: DomElement, context: LoaderContext, attrs: Sequence[str]) -> list[str]:
        """Return the values of attributes in a context. Raises KeyError for a missing attribute."""
        values = []
        for name, value in zip(attrs, self.opt_attrs(tag, context, attrs), strict=True):
            if value is None:
                raise KeyError(name)
            values.append(value)
        return values
