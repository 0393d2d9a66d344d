"""Reads `<node>`, `<test>` and `<machine>`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

from pipros import names
from pipros.launch.attributes import Attributes
from pipros.launch.draft import Draft
from pipros.launch.model import LaunchError, Machine, Node, Output, Test, WorkingFolder
from pipros.launch.parameters import read_param, read_rosparam
from pipros.launch.scope import Scope
from pipros.launch.surroundings import Surroundings
from pipros.safe.xml import Element

_SHARED = ("pkg", "type", "machine", "args", "ns", "clear_params", "cwd", "launch-prefix", "required")
_NODE_ONLY = ("name", "respawn", "respawn_delay", "output")
_TEST_ONLY = ("test-name", "name", "time-limit", "retry")
_REFUSED_IN_TEST = ("output", "respawn", "respawn_delay")

_Choice = TypeVar("_Choice", Output, WorkingFolder)


def read_node(element: Element, scope: Scope, draft: Draft, surroundings: Surroundings) -> None:
    """Adds the node of a `<node>` and its parameters to the draft."""
    attributes = Attributes(element, scope)
    draft.warn(*attributes.unknown((*_SHARED, *_NODE_ONLY)))
    try:
        node = _read(attributes, element, scope, draft, surroundings, attributes.required("name"))
        node = replace(
            node,
            respawn=attributes.flag("respawn"),
            respawn_delay_s=attributes.number("respawn_delay", 0.0),
            required=attributes.flag("required"),
            output=_choice(attributes, "output", Output.LOG),
        )
        if node.respawn and node.required:
            raise attributes.error("respawn and required cannot both be set to true")
    except LaunchError as error:
        raise _invalid(error, "node") from error.__cause__
    draft.add_node(node)


def read_test(element: Element, scope: Scope, draft: Draft, surroundings: Surroundings) -> None:
    """Adds the test of a `<test>` and its parameters to the draft."""
    attributes = Attributes(element, scope)
    draft.warn(*attributes.unknown((*_SHARED, *_TEST_ONLY, *_REFUSED_IN_TEST)))
    try:
        test_name = attributes.required("test-name")
        for refused in _REFUSED_IN_TEST:
            if refused in element.attributes:
                raise attributes.error(f"<test> tags cannot have '{refused}' attribute")
        node = _read(attributes, element, scope, draft, surroundings, attributes.text("name") or test_name)
        test = Test(node, test_name, _time_limit_s(attributes), _retry(attributes))
    except LaunchError as error:
        raise _invalid(error, "test") from error.__cause__
    draft.add_test(test)


def _read(
    attributes: Attributes,
    element: Element,
    scope: Scope,
    draft: Draft,
    surroundings: Surroundings,
    name: str,
) -> Node:
    """What nodes and tests have in common; their children are carried out on the way."""
    if "/" in name:
        raise attributes.error("node name cannot contain a namespace")
    if not names.is_legal_base(name):
        draft.warn(
            f"WARN: illegal <node> name '{name}'.\nhttp://ros.org/wiki/Names\n"
            f"This will likely cause problems with other ROS tools.\nThe node is in {attributes.place}"
        )
    package, type_name = attributes.required("pkg"), attributes.required("type")
    if not package:
        raise attributes.error("package must be non-empty")
    if not type_name:
        raise attributes.error("type must be non-empty")
    inner = open_namespace(attributes, element, scope)
    private = inner.child(name)
    if attributes.text("clear_params") and attributes.flag("clear_params"):
        draft.clear_params(private.namespace)
    machine = attributes.text("machine") or scope.default_machine
    _read_children(element, inner, private, draft, surroundings)
    return Node(
        package=package,
        type=type_name,
        name=name,
        namespace=inner.namespace,
        arguments=attributes.text("args") or "",
        remappings=tuple(inner.remappings),
        environment=tuple(inner.environment),
        machine=machine,
        required=False,
        working_folder=_choice(attributes, "cwd", WorkingFolder.ROS_HOME),
        launch_prefix=attributes.text("launch-prefix") or "",
        place=attributes.place,
    )


def _read_children(
    element: Element, inner: Scope, private: Scope, draft: Draft, surroundings: Surroundings
) -> None:
    """Carries out what stands inside of a node.

    Parameters given by `<param>` are set after those of `<rosparam>`, wherever they stand, and those
    that private names outside promised to every node come first: so Noetic has it.
    """
    params: dict[str, Any] = {
        private.resolve_param(key[1:]): value for key, value in inner.private_params.items()
    }
    for child in element.children:
        attributes = Attributes(child, inner)
        if child.tag not in ("param", "rosparam", "remap", "env"):
            draft.warn(f"WARN: unrecognized '{child.tag}' child tag in the parent tag element: "
                       f"<{element.tag}> in {attributes.place}")  # fmt: skip
        elif not attributes.is_wanted():
            continue
        elif child.tag == "remap":
            read_remap(child, inner, draft)
        elif child.tag == "env":
            read_env(child, inner, draft)
        elif child.tag == "param":
            # Inside of a node even a name with a leading slash is the node's own: so Noetic has it.
            name, value = read_param(child, private, draft, surroundings)
            params[private.resolve_param(name.lstrip("~/"))] = value
        else:
            for key, value in read_rosparam(child, private, draft, surroundings).items():
                draft.add_param(_own(private, key), value)
    for key, value in params.items():
        draft.add_param(key, value)


def _own(private: Scope, key: str) -> str:
    """`~name` inside of a node is the node's own parameter, like `name`."""
    return private.resolve_param(key[1:]) if names.is_private(key) else key


def open_namespace(attributes: Attributes, element: Element, scope: Scope) -> Scope:
    """The scope that the `ns` of an element opens."""
    namespace = attributes.text("ns")
    if namespace == "":
        raise attributes.error(f"<{element.tag}> tag has an empty 'ns' attribute")
    try:
        return scope.child(namespace or "")
    except ValueError as error:
        raise attributes.error(str(error)) from None


def read_remap(element: Element, scope: Scope, draft: Draft) -> None:
    attributes = Attributes(element, scope)
    draft.warn(*attributes.unknown(("from", "to")))
    source, target = attributes.text("from"), attributes.text("to")
    if source is None or target is None:
        raise attributes.error("Invalid <remap> tag: <remap> tag is missing required from/to attributes")
    try:
        scope.remap(source, target)
    except ValueError as error:
        raise attributes.error(f"Invalid <remap> tag: {error}") from None


def read_env(element: Element, scope: Scope, draft: Draft) -> None:
    attributes = Attributes(element, scope)
    draft.warn(*attributes.unknown(("name", "value")))
    name, value = attributes.text("name"), attributes.text("value")
    if name is None or value is None:
        raise attributes.error("<env> tag is missing required name/value attributes")
    if not name:
        raise attributes.error("Invalid <env> tag: 'name' attribute must be non-empty")
    if "=" in name or "\0" in name or "\0" in value:
        raise attributes.error(f"Invalid <env> tag: [{name}] cannot be the name of an environment variable")
    scope.environment.append((name, value))


_ANCIENT = ("ros-root", "ros-package-path", "ros-ip", "ros-host-name")


def read_machine(element: Element, scope: Scope, draft: Draft) -> None:
    """Adds the computer of a `<machine>` to the draft; a default one takes the nodes that follow."""
    attributes = Attributes(element, scope)
    if any(name in element.attributes for name in _ANCIENT):
        raise attributes.error(
            "<machine>: ros-* attributes are not supported since ROS Fuerte.\nPlease use env-loader instead."
        )
    if element.first("env") is not None:
        raise attributes.error(
            "<machine>: <env> tag is not supported since ROS Fuerte.\nPlease use env-loader instead."
        )
    draft.warn(
        *attributes.unknown(
            ("name", "address", "ssh-port", "env-loader", "user", "password", "default", "timeout")
        )
    )
    default = (attributes.text("default") or "false").lower()
    if default not in ("true", "false", "never"):
        raise attributes.error(f"Invalid value for 'attribute': {default}")
    if not attributes.required("name"):
        raise attributes.error("a machine's name must be non-empty")
    machine = Machine(
        name=attributes.required("name"),
        address=attributes.required("address"),
        user=attributes.text("user") or "",
        password=attributes.text("password") or "",
        ssh_port=_ssh_port(attributes),
        env_loader=attributes.text("env-loader") or "",
        timeout_s=_positive(attributes, "timeout", 10.0),
        is_default=default == "true",
        place=attributes.place,
    )
    draft.add_machine(machine)
    if machine.is_default:
        scope.default_machine = machine.name


def _ssh_port(attributes: Attributes) -> int:
    text = attributes.text("ssh-port") or "22"
    if not text.isdecimal() or not 0 < int(text) < 65536:
        raise attributes.error(f"'ssh-port' must be a port number: [{text}]")
    return int(text)


def _positive(attributes: Attributes, name: str, default: float) -> float:
    text = attributes.text(name)
    try:
        number = default if text is None else float(text)
    except ValueError:
        raise attributes.error(f"'{name}' must be a number: [{text}]") from None
    if not number > 0:
        raise attributes.error(f"'{name}' must be a positive number: [{number}]")
    return number


def _time_limit_s(attributes: Attributes) -> float:
    return _positive(attributes, "time-limit", 60.0)


def _retry(attributes: Attributes) -> int:
    text = attributes.text("retry")
    try:
        return int(text or "0")
    except ValueError:
        raise attributes.error(f"'retry' must be a number: [{text}]") from None


def _choice(attributes: Attributes, name: str, default: _Choice) -> _Choice:
    text = attributes.text(name)
    if text is None:
        return default
    choices = list(type(default))
    for choice in choices:
        if choice.value == text:
            return choice
    allowed = ", ".join(f"'{choice.value}'" for choice in choices)
    raise attributes.error(f"{name} must be one of {allowed}")


def _invalid(error: LaunchError, tag: str) -> LaunchError:
    """The error of a node's attribute, with the words that Noetic puts before it."""
    if error.reason.startswith(("Invalid", "<", "[", "error", "cannot set")):
        return error
    return LaunchError(f"Invalid <{tag}> tag: {error.reason}.", error.places, error.element)
