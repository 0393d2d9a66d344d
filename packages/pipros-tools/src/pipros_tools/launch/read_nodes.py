"""Reads the `<node>` and `<test>` elements of launch files."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pipros.basics import names
from pipros_tools.launch.model import (
    NODE_ATTRIBUTES,
    NODE_SETTINGS,
    LaunchError,
    LaunchNode,
    NodeSetting,
    Output,
    Test,
)
from pipros_tools.launch.read_params import read_param, read_rosparam
from pipros_tools.launch.read_scope import read_env, read_remap
from pipros_tools.launch.reader import ElementReader
from pipros_tools.launch.ros2_node import ARGUMENT as ROS2_PYTHON
from pipros_tools.launch.scope import LaunchScope

_TEST_ONLY = ("test-name", "time-limit", "retry")


def read_node(reader: ElementReader) -> None:
    """Read a `<node>`, and add the node and its parameters to the launch."""
    reader.allow(*NODE_ATTRIBUTES)
    try:
        node = _read(reader, reader.required("name"))
        if node.respawn and node.required:
            raise reader.error("respawn and required cannot both be set to true")
    except LaunchError as error:
        raise _invalid(error, "node") from error.__cause__
    reader.builder.add_node(node)


def read_test(reader: ElementReader) -> None:
    """Read a `<test>`, and add the test and its parameters to the launch."""
    reader.allow(*NODE_ATTRIBUTES, *_TEST_ONLY)
    try:
        test_name = reader.required("test-name")
        for setting in NODE_SETTINGS:
            if not setting.in_tests and reader.has(setting.xml):
                raise reader.error(f"<test> tags cannot have '{setting.xml}' attribute")
        node = _read(reader, reader.text("name") or test_name)
        # `required` has no effect, but Noetic refuses an invalid value.
        node = replace(node, output=Output.LOG, required=False)
        limit_s = reader.positive("time-limit", 60.0) if reader.text("time-limit") else 60.0
        test = Test(node, test_name, limit_s, reader.whole_number("retry", 0))
    except LaunchError as error:
        raise _invalid(error, "test") from error.__cause__
    reader.builder.add_test(test)


def _read(reader: ElementReader, name: str) -> LaunchNode:
    """Read the attributes and children shared by nodes and tests."""
    if "/" in name:
        raise reader.error("node name cannot contain a namespace")
    if not names.is_legal_base(name):
        reader.warn(
            f"WARN: illegal <node> name '{name}'.\nhttp://ros.org/wiki/Names\n"
            f"This will likely cause problems with other ROS tools.\nThe node is in {reader.place}"
        )
    package, type_name = reader.required("pkg"), reader.required("type")
    if not package.strip():
        raise reader.error("package must be non-empty")
    if not type_name.strip():
        raise reader.error("type must be non-empty")
    inner = reader.open_namespace()
    try:
        private = inner.child(name)
    except ValueError as error:
        raise reader.error(str(error)) from None
    if reader.text("clear_params") and reader.flag("clear_params"):
        reader.builder.clear_params(private.namespace)
    _read_children(reader, inner, private)
    found: dict[str, Any] = {
        "package": package,
        "type": type_name,
        "name": name,
        "namespace": inner.namespace,
        "remappings": tuple(inner.remappings.values()),
        "environment": tuple(inner.environment),
        "machine": reader.text("machine") or reader.scope.default_machine,
        "ros2_python": inner.arguments.get(ROS2_PYTHON) or "",
        "place": reader.place,
    }
    rest = {each.field: _value(reader, each) for each in NODE_SETTINGS if each.field not in found}
    return LaunchNode(**found, **rest)


def _value(reader: ElementReader, setting: NodeSetting) -> Any:
    """Return the value of an attribute, which has the type of its default."""
    if setting.choices is not None:
        return reader.choice(setting.xml, setting.choices)
    if isinstance(setting.default, bool):
        return reader.flag(setting.xml)
    if isinstance(setting.default, float):
        return reader.number(setting.xml, setting.default)
    return reader.text(setting.xml) or setting.default


def _read_children(reader: ElementReader, inner: LaunchScope, private: LaunchScope) -> None:
    """Read the children of a node.

    As in Noetic, parameters from `<param>` are set after parameters from `<rosparam>`, regardless of their
    order in the file. Private parameters declared outside of nodes, which apply to every node, are set before
    both.
    """
    reader.builder.use_private(inner.private_params)
    params: dict[str, Any] = {
        private.resolve_private(key): value for key, value in inner.private_params.items()
    }
    for child in reader.inside(inner).children():
        tag = child.tag.lower()  # Noetic ignores the case of these tags, and only of these
        if tag not in ("param", "rosparam", "remap", "env"):
            child.warn(f"WARN: unrecognized '{child.tag}' child tag in the parent tag element: "
                       f"<{reader.tag}> in {child.place}")  # fmt: skip
        elif not child.is_wanted():
            continue
        elif tag == "remap":
            read_remap(child)
        elif tag == "env":
            read_env(child)
        elif tag == "param":
            # As in Noetic, even a name with a leading slash is private inside a node.
            name, value = read_param(child.inside(private))
            params[private.resolve_param(name.lstrip("~/"))] = value
        else:
            for key, value in read_rosparam(child.inside(private), is_in_node=True).items():
                reader.builder.add_param(private.resolve_private(key), value)
    for key, value in params.items():
        reader.builder.add_param(key, value)


def _invalid(error: LaunchError, tag: str) -> LaunchError:
    """Prefix the text of an error as Noetic does, unless the text already names the element."""
    if error.reason.startswith(("Invalid", "<", "[", "error", "cannot set")):
        return error
    return LaunchError(f"Invalid <{tag}> tag: {error.reason}.", error.places, error.element)
