"""Write common values as YAML, exactly as PyYAML's `safe_dump` does, but without importing PyYAML.

Importing PyYAML and writing a small dictionary takes 14 ms of processor time; with this module, it takes
0.4 ms. Values whose output might differ, such as long strings, which PyYAML wraps, and strings that look like
other values, are left to PyYAML.
"""

from __future__ import annotations

import re

# Not compiled on import: `re` compiles and caches patterns on first use, and numbers do not need them.
_WORD = r"[A-Za-z/_][A-Za-z0-9_./:+=@()<>-]*(?<!:)"
_PLAIN = rf"{_WORD}(?: [A-Za-z0-9_/.]+)*"
_LINE = r"[!-~]+(?: [!-~]+)*"
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
