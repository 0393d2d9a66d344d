"""Parameters as text, without a master. PyYAML is imported only for values that need it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from pipros.printable import listed, printable_lines

END_OF_SCALAR = "...\n"
"""The end of a YAML document that is a single plain scalar."""


_PLAIN_WORD = re.compile(r"[A-Za-z/][A-Za-z0-9_./-]{0,59}")
_RESERVED_WORDS = frozenset(("y", "n", "yes", "no", "true", "false", "on", "off", "null"))


def as_document(value: Any) -> str:
    """The value as a YAML document, in block style and with sorted keys."""
    if isinstance(value, bool):
        return f"{str(value).lower()}\n{END_OF_SCALAR}"
    if isinstance(value, int) or (isinstance(value, str) and _is_plain(value)):
        return f"{value}\n{END_OF_SCALAR}"
    import yaml

    text: str = yaml.safe_dump(value)
    return text


def _is_plain(text: str) -> bool:
    """True for words that YAML writes without quotes; doubtful ones are left to PyYAML."""
    return _PLAIN_WORD.fullmatch(text) is not None and text.lower() not in _RESERVED_WORDS


def as_shown(value: Any) -> str:
    """The document as Noetic prints it: a plain scalar alone, any other value with an empty line after it."""
    text = as_document(value)
    return text.removesuffix(END_OF_SCALAR) if text.endswith(END_OF_SCALAR) else text + "\n"


def as_pretty_text(tree: Mapping[str, Any], indent: str = "") -> str:
    """A namespace in a form that is easy to read but is not YAML: strings have no quotes.

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
