"""Loads launch files: the XML language of http://wiki.ros.org/roslaunch/XML, as interpreted by Noetic.

This module reads files and returns a `Launch`. Elements are processed in document order, each in its scope.
No node is started, and the parameter server is not contacted, but commands in `<param command="…">` are run.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence

from pipros.basics import names
from pipros.safe.xml import Element, XmlError, parse
from pipros_tools.launch.budget import LaunchBudget, OverBudget
from pipros_tools.launch.builder import LaunchBuilder
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import Launch, LaunchError, Place
from pipros_tools.launch.read_machines import read_machine
from pipros_tools.launch.read_nodes import read_node, read_test
from pipros_tools.launch.read_params import read_param, read_rosparam
from pipros_tools.launch.read_scope import read_arg, read_env, read_included_arguments, read_remap
from pipros_tools.launch.reader import ElementReader
from pipros_tools.launch.scope import LaunchScope
from pipros_tools.launch.substitute import Substitution, UnsetArgument

INCLUDE_LIMIT = 60
"""Maximum nesting of includes; deeper nesting is considered a cycle."""

DEFUNCT_MASTER = "ignoring defunct <master /> tag"


def load(
    files: Sequence[str],
    arguments: Mapping[str, str] | None = None,
    *,
    context: LoadContext | None = None,
    texts: Sequence[str] = (),
    unset_as: str | None = None,
    arguments_only: bool = False,
) -> Launch:
    """Load launch files into one `Launch`.

    Args:
        arguments: `name:=value` arguments from the command line, for every file.
        texts: contents of additional launch files, such as standard input; processed after the files.
        unset_as: the value to use for unset arguments, for tools that only inspect the file; by default,
            unset arguments are an error.
        arguments_only: whether to read only these files' own `<arg>`s, not those in included files.

    Raises:
        LaunchError: a file is invalid. The error names the file, line and element.
    """
    loader = Loader(
        context or LoadContext.of_process(),
        arguments or {},
        unset_as=unset_as,
        arguments_only=arguments_only,
    )
    for file in files:
        loader.load_file(file)
    for text in texts:
        loader.load_text(text)
    return loader.finish()


class Loader:
    """Loads launch files one after another into one `Launch`.

    Attributes:
        arguments: command-line arguments for the next file.
        before_unset: with `skips_unset`, the contents of the files up to the first `<arg>` without a value;
            None if all arguments have values.
    """

    def __init__(
        self,
        context: LoadContext,
        arguments: Mapping[str, str],
        *,
        unset_as: str | None = None,
        arguments_only: bool = False,
        skips_unset: bool = False,
        builder: LaunchBuilder | None = None,
    ) -> None:
        """Store the arguments. Files are read by `load_file`.

        Args:
            unset_as, arguments_only: see `load`.
            skips_unset: whether to skip the rest of a file after the first use of an argument without a
                value, as Noetic does if it checks a file without its arguments.
            builder: collects the contents; by default, an empty builder is used.
        """
        self._budget = LaunchBudget()
        self._context = context.within(self._budget)
        self.arguments: dict[str, str | None] = dict(arguments)
        self._unset_as = unset_as
        self._arguments_only = arguments_only
        self._skips_unset = skips_unset
        self.before_unset: Launch | None = None
        self._builder = builder or LaunchBuilder()
        self._depth = 0

    def load_file(self, file: str) -> LaunchScope:
        """Read a file and return its outermost scope, in its final state."""
        scope = self._root_scope(file, os.path.dirname(os.path.abspath(file)))
        self._load(file, scope)
        return scope

    def load_text(self, text: str) -> LaunchScope:
        """Like `load_file`, but read the launch file from a string."""
        scope = self._root_scope("<stdin>", None)
        self._process_root(_parse(text, "<stdin>"), scope)
        return scope

    def finish(self) -> Launch:
        return self._builder.finish()

    def _root_scope(self, file: str, folder: str | None) -> LaunchScope:
        substitution = Substitution(
            self._context.find,
            self._context.environment,
            self._context.make_anonymous,
            arguments=dict(self.arguments),
            folder=folder,
            unset_as=self._unset_as,
            budget=self._budget,
        )
        namespace = (self._context.environment.get("ROS_NAMESPACE") or "").strip("/")
        root = f"/{namespace}/" if namespace else "/"
        return LaunchScope(root, file, substitution, given=frozenset(self.arguments))

    def _load(self, file: str, scope: LaunchScope) -> bool:
        """Read a file. Return False if the rest of it was skipped."""
        try:
            content = self._context.read_file(file)
        except OSError as error:
            raise LaunchError(f"cannot read [{file}]: {error.strerror or error}") from None
        except OverBudget as error:
            raise LaunchError(f"cannot read [{file}]: {error}") from None
        self._builder.add_file(file)
        return self._process_root(_parse(content, file), scope)

    def _process_root(self, root: Element, scope: LaunchScope) -> bool:
        if root.tag != "launch" or _has_launch(root):
            raise LaunchError(
                "Invalid roslaunch XML syntax: no root <launch> tag"
                if root.tag != "launch"
                else "Invalid roslaunch XML syntax: a <launch> tag cannot be inside of another one",
                [Place(scope.file, root.line, root.column)],
                f"<{root.tag}>",
            )
        if root.attributes.get("deprecated"):
            self._builder.warn(f"[{scope.file}] DEPRECATED: {root.attributes['deprecated']}")
        try:
            reader = ElementReader(root, scope, self._builder, self._context)
            reader.is_wanted()  # as in Noetic, an invalid condition is an error; a valid one has no effect
            self._process(reader)
        except LaunchError as error:
            if not self._skips_unset or not self._is_unset(error.__cause__):
                raise
            return False
        return True

    def _is_unset(self, error: BaseException | None) -> bool:
        """Return whether an unset argument, and not an undeclared argument, caused the error.

        Once text has been skipped, undeclared arguments count as unset, because that text may declare them.
        """
        return isinstance(error, UnsetArgument) and (error.is_declared or self.before_unset is not None)

    def _process(self, parent: ElementReader) -> None:
        for reader in parent.children():
            process = _ELEMENTS.get(reader.tag)
            if self._arguments_only and reader.tag not in ("arg", "master"):
                continue
            if process is None:
                reader.warn(f"unrecognized tag {reader.tag} in {reader.place}")
            elif reader.tag == "master" or reader.is_wanted():
                process(self, reader)

    def _param(self, reader: ElementReader) -> None:
        name, value = read_param(reader)
        _set(reader, reader.scope.resolve_param(name), value)

    def _rosparam(self, reader: ElementReader) -> None:
        for key, value in read_rosparam(reader).items():
            _set(reader, key, value)

    def _master(self, reader: ElementReader) -> None:
        reader.warn(f"{DEFUNCT_MASTER} in {reader.place}")

    def _arg(self, reader: ElementReader) -> None:
        argument = read_arg(reader)
        if self._skips_unset and self.before_unset is None and reader.scope.arguments[argument.name] is None:
            self.before_unset = self.finish()
        if self._depth == 0:
            self._builder.add_argument(argument)

    def _group(self, reader: ElementReader) -> None:
        reader.allow("ns", "clear_params")
        inner = reader.open_namespace()
        _clear_params(reader, inner)
        self._process(reader.inside(inner))
        # Unlike everything else, a default machine stays set after its group, as in Noetic.
        reader.scope.default_machine = inner.default_machine

    def _include(self, reader: ElementReader) -> None:
        reader.allow("file", "ns", "clear_params", "pass_all_args")
        file = reader.required("file")
        inner = reader.open_namespace()
        _clear_params(reader, inner)
        pass_all = reader.flag("pass_all_args")
        outer = inner.child()
        given = read_included_arguments(reader.inside(outer), inner.arguments if pass_all else None)
        passed = {**inner.arguments, **given} if pass_all else given
        folder = os.path.dirname(os.path.abspath(file))
        included = outer.included("", file, folder, passed, passed_all=pass_all)
        if self._depth >= INCLUDE_LIMIT:
            raise reader.error(f"includes are nested more than {INCLUDE_LIMIT} deep; is there a cycle?")
        try:
            self._budget.add_include()
        except OverBudget as error:
            raise reader.error(str(error)) from None
        self._depth += 1
        reader.builder.add_include(reader.scope.file, file)
        try:
            is_complete = self._load(file, included)
        except LaunchError as error:
            chain = [*error.places, reader.place]
            raise LaunchError(error.reason, _shortened(chain), error.element) from error.__cause__
        finally:
            self._depth -= 1
        unused = [name for name in given if name not in included.declared]
        if unused and not pass_all and is_complete:
            raise reader.error(f"unused args [{', '.join(unused)}] for include of [{file}]")
        reader.scope.default_machine = included.default_machine


_ELEMENTS: Mapping[str, Callable[[Loader, ElementReader], object]] = {
    "arg": Loader._arg,
    "env": lambda _, reader: read_env(reader),
    "group": Loader._group,
    "include": Loader._include,
    "machine": lambda _, reader: read_machine(reader),
    "master": Loader._master,
    "node": lambda _, reader: read_node(reader),
    "param": Loader._param,
    "remap": lambda _, reader: read_remap(reader),
    "rosparam": Loader._rosparam,
    "test": lambda _, reader: read_test(reader),
}


def _set(reader: ElementReader, key: str, value: object) -> None:
    if names.is_private(key):
        reader.scope.private_params[key] = value
        reader.builder.declare_private(key, reader.place)
    else:
        reader.builder.add_param(key, value)


def _clear_params(reader: ElementReader, inner: LaunchScope) -> None:
    if not reader.text("clear_params") or not reader.flag("clear_params"):
        return
    if not reader.has("ns"):
        raise reader.error("'ns' attribute must be set in order to use 'clear_params'")
    if inner.namespace == "/":
        raise reader.error("'clear_params' in the namespace / would delete all parameters")
    reader.builder.clear_params(inner.namespace)


def _has_launch(element: Element) -> bool:
    return any(child.tag == "launch" or _has_launch(child) for child in element.children)


def _parse(content: bytes | str, file: str) -> Element:
    try:
        return parse(content, file)
    except XmlError as error:
        reason = error.reason.removeprefix("invalid XML: ")
        raise LaunchError(
            f"Invalid roslaunch XML syntax: {reason}", [Place(file, error.line, error.column)]
        ) from None


def _shortened(chain: list[Place]) -> list[Place]:
    """Shorten a long chain of includes by removing the middle."""
    return chain if len(chain) <= 6 else [*chain[:3], *chain[-2:]]
