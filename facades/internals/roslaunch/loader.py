"""Code shared by launch file loaders: element contexts, value types and parameters."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Any

from pipros.basics import names
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.load_context import LoadContext
from pipros.launch.param_types import flatten, parameters_in
from pipros.launch.scope import checked_remapping
from pipros.safe.yaml import YamlError
from rosgraph.names import canonicalize_name, is_legal_name, load_mappings, make_global_ns, ns_join
from roslaunch.core import PHASE_SETUP, Param, RLException, RosbinExecutable
from roslaunch.substitution_args import convert_value

__all__ = [
    "PHASE_SETUP",
    "PRIV_NAME",
    "LoadException",
    "Loader",
    "LoaderContext",
    "Param",
    "RLException",
    "RosbinExecutable",
    "canonicalize_name",
    "convert_value",
    "is_legal_name",
    "load_mappings",
    "load_sysargs_into_context",
    "make_global_ns",
    "ns_join",
    "post_process_include_args",
    "process_include_args",
]

_star_names(__name__, "copy:deepcopy errno os sys yaml")

PRIV_NAME = "~"

_PARAM_SOURCES = "value", "textfile", "binfile", "command"


class LoadException(RLException):
    """A resource of a launch file cannot be loaded."""


class LoaderContext:
    """The namespace, arguments, remappings and private parameters of an element in a launch file.

    Attributes:
        resolve_dict: the context for `resolve_args`, which contains `arg` and `arg_doc`.
        include_resolve_dict: the `resolve_dict` of the included file while an `<include>` is read.
        arg_names: the arguments declared so far.
        args_passed: the arguments passed by an `<include>`.
    """

    def __init__(
        self,
        ns: str,
        filename: str | None,
        parent: LoaderContext | None = None,
        params: list[Param] | None = None,
        env_args: list[tuple[str, str]] | None = None,
        resolve_dict: dict[str, Any] | None = None,
        include_resolve_dict: dict[str, Any] | None = None,
        arg_names: list[str] | None = None,
    ) -> None:
        self.parent = parent
        self.ns = names.make_global_namespace(ns or "/")
        self.params = params or []
        self.env_args = env_args or []
        self.filename = filename
        self.resolve_dict = resolve_dict or {}
        self.arg_names = arg_names or []
        self.args_passed: list[str] = []
        self.include_resolve_dict = include_resolve_dict or None
        self.pass_all_args = False
        self._remap_args: list[list[str]] = []

    def add_param(self, p: Param) -> None:
        """Add a private parameter for all subsequent nodes, replacing any parameter with the same name."""
        self.params[:] = [param for param in self.params if param.key != p.key] + [p]

    def add_remap(self, remap: Sequence[str]) -> None:
        """Add a remapping, replacing any remapping with the same name.

        Raises:
            RLException: a name is empty or illegal.
        """
        try:
            source, target = checked_remapping(*remap)
        except ValueError as error:
            raise RLException(str(error)) from None
        self._remap_args = [pair for pair in self._remap_args if pair[0] != source] + [[source, target]]

    def add_arg(
        self, name: str, default: str | None = None, value: str | None = None, doc: str | None = None
    ) -> None:
        """Declare an argument, and set it unless the caller has set it.

        Raises:
            LoadException: the argument was already declared, or `value` would override the caller's value.
        """
        self._declare(name)
        context = self.resolve_dict if self.include_resolve_dict is None else self.include_resolve_dict
        arguments = context.setdefault("arg", {})
        documented = context.setdefault("arg_doc", {})
        if not value:
            documented[name] = (doc, default)
        if value is None:
            arguments.update({} if default is None else {name: arguments.get(name, default)})
            return
        if name in arguments and not self.pass_all_args:
            raise LoadException(f"cannot override arg '{name}', which has already been set")
        arguments[name] = value

    def _declare(self, name: str) -> None:
        if name not in self.arg_names:
            self.arg_names.append(name)
        elif not self.pass_all_args:
            raise LoadException(f"arg '{name}' has already been declared")

    def remap_args(self) -> list[list[str]]:
        """Return the remappings of this context and its parents."""
        if self.parent is None:
            return list(self._remap_args)
        own = {pair[0] for pair in self._remap_args}
        return [pair for pair in self.parent.remap_args() if pair[0] not in own] + self._remap_args

    def child(self, ns: str | None) -> LoaderContext:
        """Return a nested context.

        It inherits everything, but shares only the parameters with this context.
        """
        inner = self.ns
        if ns:
            inner = ns if ns.startswith("/") or ns == PRIV_NAME else names.join(self.ns, ns)
        return LoaderContext(
            inner,
            self.filename,
            parent=self,
            params=self.params,
            env_args=list(self.env_args),
            resolve_dict=copy.deepcopy(self.resolve_dict),
            arg_names=list(self.arg_names),
            include_resolve_dict=self.include_resolve_dict,
        )

    def include_child(self, ns: str | None, filename: str) -> LoaderContext:
        """Return a context for an included file, without declared arguments."""
        inner = self.child(ns)
        inner.arg_names = []
        inner.filename = filename
        inner.include_resolve_dict = {}
        return inner


def process_include_args(context: LoaderContext) -> None:
    """Pass the arguments of an `<include>` to the included file.

    Raises:
        LoadException: an argument has no value.
    """
    passed = context.include_resolve_dict or {}
    arguments = passed.get("arg", {})
    if any(name not in arguments for name in context.arg_names):
        raise LoadException("include args must have declared values")
    context.args_passed = list(arguments)
    context.arg_names = []
    context.resolve_dict = passed
    context.include_resolve_dict = None


def post_process_include_args(context: LoaderContext) -> None:
    """Check that the included file declared all arguments passed to it.

    Raises:
        LoadException: an argument was not declared.
    """
    unused = [name for name in context.args_passed if name not in context.arg_names]
    if unused:
        raise LoadException(f"unused args [{', '.join(unused)}] for include of [{context.filename}]")


def load_sysargs_into_context(context: LoaderContext, argv: Sequence[str]) -> None:
    """Set arguments from the `name:=value` words on a command line."""
    from pipros.launch.arguments import split_arguments

    context.resolve_dict["arg"] = split_arguments(argv)[0]


class Loader:
    """Base class of loaders, which add the contents of launch files to a configuration."""

    def add_param(self, ros_config: Any, param_name: str, param_value: Any, verbose: bool = True) -> None:
        """Add a parameter. For a dictionary, add a parameter for each value in it."""
        for key, value in flatten(param_name, param_value).items():
            ros_config.add_param(Param(key, value), verbose=verbose)

    def param_value(
        self,
        verbose: bool,
        name: str,
        ptype: str,
        value: str | None,
        textfile: str | None,
        binfile: str | None,
        command: str | None,
    ) -> Any:
        """Return the value of a `<param>`, from the first of its four sources that is not None.

        Raises:
            ValueError: all sources are None, the text is invalid for the type, or the command fails.
            OSError: the file cannot be read.
        """
        context = LoadContext.of_process()
        if value is not None:
            return convert_value(value.strip(), ptype)
        if textfile is not None:
            return convert_value(context.read_file(textfile).decode(), ptype)
        if binfile is not None:
            from xmlrpc.client import Binary

            return Binary(context.read_file(binfile))
        if command is None:
            raise ValueError(f"<param> [{name}] needs one of {', '.join(_PARAM_SOURCES)}")
        if verbose:
            print(f"... executing command param [{command}]")
        return convert_value(context.run_command(command), ptype)

    def load_rosparam(
        self,
        context: LoaderContext,
        ros_config: Any,
        cmd: str,
        param: str | None,
        file_: str | None,
        text: str,
        verbose: bool = True,
        subst_function: Callable[[str], str] | None = None,
    ) -> None:
        """Add the parameters that a `<rosparam>` loads, or the command that it contains.

        Raises:
            ValueError: the command is unknown, `file_` is given for `delete`, `param` is missing for a value
                that is not a dictionary, or a key is not a string.
            LoadException: the file or its YAML cannot be read.
        """
        _check_command(cmd, file_)
        full = names.join(context.ns, param or "")
        if cmd != "load":
            words: Any = (cmd, file_, full) if cmd == "dump" else (cmd, full)
            ros_config.add_executable(RosbinExecutable("rosparam", words, PHASE_SETUP))
            return
        if file_ is not None:
            text = _text_of(file_)
        if subst_function is not None:
            text = subst_function(text)
        sources = file_, context.filename
        for key, value in _parameters_in(text, sources, full, is_named=bool(param)).items():
            ros_config.add_param(Param(key, value), verbose=verbose)

    def load_env(self, context: LoaderContext, ros_config: Any, name: str, value: str) -> None:
        """Add an environment variable for all subsequent nodes of a context."""
        _ = ros_config
        context.env_args.append((name, value))


def _text_of(file: str) -> str:
    try:
        return LoadContext.of_process().read_file(file).decode()
    except FileNotFoundError:
        raise LoadException(f"file does not exist [{file}]") from None


def _check_command(command: str, file: str | None) -> None:
    if command not in ("load", "dump", "delete"):
        raise ValueError("command must be 'load', 'dump', or 'delete'")
    if command == "delete" and file is not None:
        raise ValueError("'file' attribute is invalid with 'delete' command.")


def _parameters_in(text: str, sources: Sequence[str | None], key: str, *, is_named: bool) -> dict[str, Any]:
    try:
        source = next(filter(None, sources), "<rosparam>")
        return parameters_in(text, source, key, is_named=is_named)
    except YamlError as error:
        raise LoadException(f"error loading <rosparam> tag: \n\t{error}") from error
