"""Loads launch files: the XML language of http://wiki.ros.org/roslaunch/XML, as Noetic understands it.

Files in, a `Launch` out. Elements are carried out in the order in which they stand, each in the scope
that it stands in. Nothing is started here, and no parameter server is asked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence

from pipros import names
from pipros.launch.attributes import Attributes
from pipros.launch.draft import Draft
from pipros.launch.model import Argument, Launch, LaunchError, Place
from pipros.launch.nodes import open_namespace, read_env, read_machine, read_node, read_remap, read_test
from pipros.launch.parameters import read_param, read_rosparam
from pipros.launch.scope import Scope
from pipros.launch.substitute import Substitution
from pipros.launch.surroundings import Surroundings
from pipros.safe.xml import Element, XmlError, parse

INCLUDE_LIMIT = 60
"""Files within files; more than that is a file that includes itself."""


def load(
    files: Sequence[str],
    arguments: Mapping[str, str] | None = None,
    *,
    surroundings: Surroundings | None = None,
    texts: Sequence[str] = (),
    unset_as: str | None = None,
) -> Launch:
    """What the files ask for, together.

    Args:
        arguments: `name:=value` from outside, seen by every file.
        texts: launch files that were read from elsewhere, such as standard input; they come after the files.
        unset_as: what arguments that nobody set become, for tools that only want to know
            about the file; by default they are an error.

    Raises:
        LaunchError: with file, line and element, for everything that Noetic refuses.
    """
    loader = Loader(surroundings or Surroundings.here(), arguments or {}, unset_as=unset_as)
    for file in files:
        loader.load_file(file)
    for text in texts:
        loader.load_text(text)
    return loader.finish()


class Loader:
    """Carries out launch files one after another into one draft.

    Attributes:
        arguments: what the next file is given from outside.
    """

    def __init__(
        self, surroundings: Surroundings, arguments: Mapping[str, str], *, unset_as: str | None = None
    ) -> None:
        self._surroundings = surroundings
        self.arguments: dict[str, str | None] = dict(arguments)
        self._unset_as = unset_as
        self._draft = Draft()
        self._depth = 0

    def load_file(self, file: str) -> None:
        scope = self._root_scope(file, os.path.dirname(os.path.abspath(file)))
        self._load(file, scope)

    def load_text(self, text: str) -> None:
        scope = self._root_scope("<stdin>", None)
        self._carry_out_root(_parse(text, "<stdin>"), scope)

    def finish(self) -> Launch:
        return self._draft.finish()

    def _root_scope(self, file: str, folder: str | None) -> Scope:
        substitution = Substitution(
            self._surroundings.find,
            self._surroundings.environment,
            self._surroundings.make_anonymous,
            arguments=dict(self.arguments),
            folder=folder,
            unset_as=self._unset_as,
        )
        namespace = (self._surroundings.environment.get("ROS_NAMESPACE") or "").strip("/")
        root = f"/{namespace}/" if namespace else "/"
        return Scope(root, file, substitution, given=frozenset(self.arguments))

    def _load(self, file: str, scope: Scope) -> None:
        try:
            content = self._surroundings.read_file(file)
        except OSError as error:
            raise LaunchError(f"cannot read [{file}]: {error.strerror or error}") from None
        self._draft.add_file(file)
        self._carry_out_root(_parse(content, file), scope)

    def _carry_out_root(self, root: Element, scope: Scope) -> None:
        if root.tag != "launch":
            raise LaunchError(
                "Invalid roslaunch XML syntax: no root <launch> tag",
                [Place(scope.file, root.line, root.column)],
                f"<{root.tag}>",
            )
        if "deprecated" in root.attributes:
            self._draft.warn(f"[{scope.file}] DEPRECATED: {root.attributes['deprecated']}")
        self._carry_out(root, scope)

    def _carry_out(self, parent: Element, scope: Scope) -> None:
        for element in parent.children:
            carry_out = _ELEMENTS.get(element.tag)
            attributes = Attributes(element, scope)
            if carry_out is None:
                self._draft.warn(f"unrecognized tag {element.tag} in {attributes.place}")
            elif attributes.is_wanted():
                carry_out(self, element, scope)

    def _node(self, element: Element, scope: Scope) -> None:
        read_node(element, scope, self._draft, self._surroundings)

    def _test(self, element: Element, scope: Scope) -> None:
        read_test(element, scope, self._draft, self._surroundings)

    def _machine(self, element: Element, scope: Scope) -> None:
        read_machine(element, scope, self._draft)

    def _remap(self, element: Element, scope: Scope) -> None:
        read_remap(element, scope, self._draft)

    def _env(self, element: Element, scope: Scope) -> None:
        read_env(element, scope, self._draft)

    def _param(self, element: Element, scope: Scope) -> None:
        name, value = read_param(element, scope, self._draft, self._surroundings)
        self._set(scope, scope.resolve_param(name), value)

    def _rosparam(self, element: Element, scope: Scope) -> None:
        for key, value in read_rosparam(element, scope, self._draft, self._surroundings).items():
            self._set(scope, key, value)

    def _set(self, scope: Scope, key: str, value: object) -> None:
        if names.is_private(key):
            scope.private_params[key] = value
        else:
            self._draft.add_param(key, value)

    def _master(self, element: Element, scope: Scope) -> None:
        self._draft.warn(f"ignoring defunct <master /> tag in {Attributes(element, scope).place}")

    def _group(self, element: Element, scope: Scope) -> None:
        attributes = Attributes(element, scope)
        self._draft.warn(*attributes.unknown(("ns", "clear_params")))
        inner = open_namespace(attributes, element, scope)
        self._clear(attributes, element, inner)
        self._carry_out(element, inner)
        # A default machine is the one thing that outlives its group.
        scope.default_machine = inner.default_machine

    def _clear(self, attributes: Attributes, element: Element, inner: Scope) -> None:
        if not attributes.text("clear_params") or not attributes.flag("clear_params"):
            return
        if "ns" not in element.attributes:
            raise attributes.error("'ns' attribute must be set in order to use 'clear_params'")
        if inner.namespace == "/":
            raise attributes.error("'clear_params' of the namespace / would delete every parameter there is")
        self._draft.clear_params(inner.namespace)

    def _arg(self, element: Element, scope: Scope) -> None:
        attributes = Attributes(element, scope)
        self._draft.warn(*attributes.unknown(("name", "value", "default", "doc")))
        try:
            if "value" in element.attributes and "default" in element.attributes:
                raise attributes.error("<arg> tag must have one and only one of value/default.")
            argument = Argument(
                attributes.required("name"),
                attributes.text("default"),
                attributes.text("value"),
                element.attributes.get("doc", ""),
            )
            scope.declare(argument)
        except LaunchError as error:
            raise LaunchError(f"Invalid <arg> tag: {error.reason}", error.places, error.element) from None
        except ValueError as error:
            raise attributes.error(f"Invalid <arg> tag: {error}.") from None
        if self._depth == 0:
            self._draft.add_argument(argument)

    def _include(self, element: Element, scope: Scope) -> None:
        attributes = Attributes(element, scope)
        self._draft.warn(*attributes.unknown(("file", "ns", "clear_params", "pass_all_args")))
        file = attributes.required("file")
        inner = open_namespace(attributes, element, scope)
        self._clear(attributes, element, inner)
        pass_all = attributes.flag("pass_all_args")
        outer = inner.child()
        given = self._included_arguments(element, outer)
        passed = {**inner.arguments, **given} if pass_all else given
        folder = os.path.dirname(os.path.abspath(file))
        included = outer.included("", file, folder, passed, passed_all=pass_all)
        if self._depth >= INCLUDE_LIMIT:
            raise attributes.error(
                f"files are included more than {INCLUDE_LIMIT} deep; does one include itself?"
            )
        self._depth += 1
        try:
            self._load(file, included)
        except LaunchError as error:
            reason = error.reason
            chain = [*error.places, attributes.place]
            raise LaunchError(reason, _shortened(chain), error.element) from error.__cause__
        finally:
            self._depth -= 1
        unused = [name for name in given if name not in included.declared]
        if unused and not pass_all:
            raise attributes.error(f"unused args [{', '.join(unused)}] for include of [{file}]")
        scope.default_machine = included.default_machine

    def _included_arguments(self, element: Element, scope: Scope) -> dict[str, str | None]:
        """The arguments that stand inside of an `<include>`; its `<env>`s go to the scope."""
        given: dict[str, str | None] = {}
        for child in element.children:
            attributes = Attributes(child, scope)
            if child.tag not in ("arg", "env"):
                self._draft.warn(f"unrecognized '{child.tag}' tag in <include> tag in {attributes.place}")
            elif not attributes.is_wanted():
                continue
            elif child.tag == "env":
                read_env(child, scope, self._draft)
            else:
                name = attributes.required("name")
                value, default = attributes.text("value"), attributes.text("default")
                if value is not None and default is not None:
                    raise attributes.error("<arg> tag must have one and only one of value/default.")
                if value is None and default is None:
                    raise attributes.error("include args must have declared values")
                given[name] = value if value is not None else default
        return given


_ELEMENTS: Mapping[str, Callable[[Loader, Element, Scope], None]] = {
    "arg": Loader._arg,
    "env": Loader._env,
    "group": Loader._group,
    "include": Loader._include,
    "machine": Loader._machine,
    "master": Loader._master,
    "node": Loader._node,
    "param": Loader._param,
    "remap": Loader._remap,
    "rosparam": Loader._rosparam,
    "test": Loader._test,
}


def _parse(content: bytes | str, file: str) -> Element:
    try:
        return parse(content, file)
    except XmlError as error:
        reason = error.reason.removeprefix("invalid XML: ")
        raise LaunchError(
            f"Invalid roslaunch XML syntax: {reason}", [Place(file, error.line, error.column)]
        ) from None


def _shortened(chain: list[Place]) -> list[Place]:
    """A chain of includes without its middle, when it is a long one."""
    return chain if len(chain) <= 6 else [*chain[:3], *chain[-2:]]
