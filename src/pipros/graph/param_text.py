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
