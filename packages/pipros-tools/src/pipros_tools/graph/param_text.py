"""Formats parameters as text. No master is needed. PyYAML is imported only for values that need it.

Importing PyYAML and writing a small dictionary takes 14 ms of processor time; `plain_document` takes 0.4 ms,
with the same output. Values whose output might differ, such as long strings, which PyYAML wraps, and strings
that look like other values, are left to PyYAML.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from pipros.basics.printable import listed, printable_lines

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


# Not compiled on import: `re` compiles and caches patterns on first use, and numbers do not need them.
_WORD = r"[A-Za-z/_][A-Za-z0-9_./:+=@()<>-]*(?<!:)"
_PLAIN = rf"{_WORD}(?: [A-Za-z0-9_/.]+){{0,999}}"
_LINE = r"[!-~]+(?: [!-~]+){0,999}"
_RESERVED = frozenset(("y", "n", "yes", "no", "true", "false", "on", "off", "null"))
_WIDTH = 70
"""Column before which a text must end, because PyYAML breaks lines at the first blank beyond 80 columns."""
_KEY_CHARACTERS = 60
_MAX_INDENT = 30
"""Maximum indentation in columns, because PyYAML lays out deeply nested text differently."""


class NotPlain(Exception):
    """Only PyYAML can write a part of the value."""


def plain_document(value: object) -> str:
    """Return the text that `yaml.safe_dump(value)` returns, except for the `...` line after a plain scalar.

    Raises:
        NotPlain: the value requires PyYAML.
    """
    if isinstance(value, (dict, list)) and value:
        return "\n".join(_lines(value, 0, set())) + "\n"
    return _scalar(value, 0, 2) + "\n"


def _lines(value: dict[object, object] | list[object], indent: int, seen: set[int]) -> list[str]:
    """Return the lines for a non-empty dictionary or list.

    `seen` contains the ids of the containers written so far.
    """
    if id(value) in seen or indent > _MAX_INDENT:  # PyYAML writes an alias for a repeated object
        raise NotPlain
    seen.add(id(value))
    if isinstance(value, dict):
        return _mapping(value, indent, seen)
    return _sequence(value, indent, seen)


def _mapping(value: dict[object, object], indent: int, seen: set[int]) -> list[str]:
    keys = [key for key in value if isinstance(key, str) and _is_key(key)]
    if len(keys) < len(value):
        raise NotPlain
    lines = []
    for key in sorted(keys):
        part, head = value[key], " " * indent + f"{key}:"
        if isinstance(part, (dict, list)) and part:
            lines.append(head)
            lines += _lines(part, indent + 2 * isinstance(part, dict), seen)
        else:
            lines.append(f"{head} {_scalar(part, len(head) + 1, indent + 2)}")
    return lines


def _sequence(value: list[object], indent: int, seen: set[int]) -> list[str]:
    lines = []
    dash = " " * indent + "- "
    for part in value:
        if isinstance(part, (dict, list)) and part:
            first, *others = _lines(part, indent + 2, seen)
            lines += [dash + first[indent + 2 :], *others]
        else:
            lines.append(dash + _scalar(part, indent + 2, indent + 2))
    return lines


def _scalar(value: object, column: int, indent: int) -> str:
    """Return the text for a scalar or an empty container that starts at `column`.

    Continuation lines are indented by `indent` columns.
    """
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if type(value) is int:
        return str(value)
    if type(value) is float:
        return _number(value)
    if type(value) is str:
        return _text(value, column, indent)
    if value == {} and type(value) is dict:
        return "{}"
    if value == [] and type(value) is list:
        return "[]"
    raise NotPlain


def _number(value: float) -> str:
    text = repr(value)
    if text in ("inf", "-inf", "nan"):
        return text.replace("inf", ".inf").replace("nan", ".nan")
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _text(text: str, column: int, indent: int) -> str:
    if not text:
        return "''"
    if re.fullmatch(_PLAIN, text) and text.lower() not in _RESERVED and column + len(text) < _WIDTH:
        return text
    lines = text.split("\n")
    if len(lines) < 2 or not lines[0] or len(lines) > _WIDTH:
        raise NotPlain
    width = _WIDTH // 2 - column
    if not all(not line or (len(line) < width and re.fullmatch(_LINE, line)) for line in lines):
        raise NotPlain
    escaped = [line.replace("'", "''") for line in lines]
    return "'" + _broken(escaped, " " * indent) + "'"


def _broken(lines: list[str], indent: str) -> str:
    """Join the lines of a quoted scalar. Each run of line breaks gets one additional break."""
    text, breaks = lines[0], 0
    for line in lines[1:]:
        breaks += 1
        if line:
            text += "\n" * (breaks + 1) + indent + line
            breaks = 0
    return text + ("\n" * (breaks + 1) + indent if breaks else "")


def _is_key(text: str) -> bool:
    return (
        len(text) < _KEY_CHARACTERS
        and re.fullmatch(_WORD, text) is not None
        and text.lower() not in _RESERVED
    )
