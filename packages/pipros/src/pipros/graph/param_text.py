"""Formats parameters as text. No master is needed. PyYAML is imported only for values that need it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.basics.printable import listed, printable_lines
from pipros.graph.plain_yaml import NotPlain, plain_document

END_OF_SCALAR = "...\n"
"""The line that ends a YAML document that is a single plain scalar."""


def as_document(value: Any) -> str:
    """Format the value as a YAML document, in block style and with sorted keys."""
    try:
        text = plain_document(value)
    except NotPlain:
        import yaml

        return str(yaml.safe_dump(value))
    is_plain_scalar = not isinstance(value, (dict, list)) and not text.startswith("'")
    return text + END_OF_SCALAR if is_plain_scalar else text


def as_shown(value: Any) -> str:
    """Format the value as Noetic prints it. Values other than plain scalars are followed by an empty line."""
    text = as_document(value)
    return text.removesuffix(END_OF_SCALAR) if text.endswith(END_OF_SCALAR) else text + "\n"


def as_pretty_text(tree: Mapping[str, Any], indent: str = "") -> str:
    """Format a namespace for display. The result is not valid YAML, because strings are not quoted.

    Control characters other than line breaks and tabs are escaped.
    """
    lines = []
    for name in sorted(tree):
        key, value = listed(name), tree[name]
        if isinstance(value, Mapping):
            lines.append(f"{indent}{key}:\n{as_pretty_text(value, indent + '  ')}")
        elif isinstance(value, str) and "\n" in value:
            value = printable_lines(value)
            lines.append(f"{indent}{key}: |\n" + "".join(f"{indent}  {line}\n" for line in value.split("\n")))
        elif isinstance(value, str):
            lines.append(f"{indent}{key}: {printable_lines(value)}\n")
        else:
            lines.append(f"{indent}{key}: {as_document(value).removesuffix(END_OF_SCALAR)}")
    return "".join(lines)


def node_parameters(node: str, tree: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the document of a ROS 2 parameter file for one node, and why parameters are left out, by name.

    ROS 2 has no values without a type, and its arrays have elements of one type; integers in an array with
    other numbers become floating-point numbers.

    Args:
        tree: the parameters below the node's name.
    """
    left_out: dict[str, str] = {}

    def kept(name: str, value: Any) -> Any:
        if isinstance(value, Mapping):
            found = {key: kept(f"{name}/{key}", each) for key, each in value.items()}
            return {key: each for key, each in found.items() if each is not None} or None
        if isinstance(value, list):
            types = {type(each) for each in value}
            if types == {int, float}:
                return [float(each) for each in value]
            if len(types) != 1 or not types <= {bool, int, float, str}:
                left_out[name] = "arrays in ROS 2 have at least one element, and elements of one simple type"
                return None
        elif not isinstance(value, (bool, int, float, str)):
            left_out[name] = f"ROS 2 has no parameters of the type {type(value).__name__}"
            return None
        return value

    if not isinstance(tree, Mapping):
        return {node: {"ros__parameters": {}}}, {node: "it is a parameter, not the name of a node"}
    return {node: {"ros__parameters": kept(node, tree) or {}}}, left_out
