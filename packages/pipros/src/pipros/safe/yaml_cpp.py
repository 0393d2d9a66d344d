"""Read YAML as C++ programs do with yaml-cpp: scalars are texts, and the reader converts them.

The rules are those of yaml-cpp 0.7, which `tests/golden/yaml_cpp.json` records. PyYAML's are those of YAML
1.1, and differ: here, `5e-2` is a number, `010` is 8 as an integer and 10 as a number, and `1_000` and `1:30`
are texts.
"""

from __future__ import annotations

import math
import re
from typing import Any

import yaml

from pipros.safe.yaml import documents

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?\s*", re.ASCII)
_INTEGER = re.compile(r"([+-]?)(0[xX])?([0-9a-fA-F]+)\s*", re.ASCII)
_SPECIAL = {
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), math.inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -math.inf),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
}
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_DIGITS = 100
"""Maximum number of digits in an integer."""


_BaseLoader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


class _Loader(_BaseLoader):  # type: ignore[misc]
    """Constructs texts; the first of equal keys counts, and null is the text `null`."""

    def construct_mapping(self, node: object, deep: bool = False) -> Any:
        if isinstance(node, yaml.MappingNode):
            node.value.reverse()
        return super().construct_mapping(node, deep)

    def construct_scalar(self, node: Any) -> Any:
        is_plain = isinstance(node, yaml.ScalarNode) and not node.style
        return "null" if is_plain and node.value in _NULLS else super().construct_scalar(node)


def load(text: str, file: str = "<string>") -> Any:
    """Return the first document in the text, with scalars as texts, or None if there is none.

    Raises:
        YamlError: the text is malformed or has too many values.
    """
    found = documents(text, file, _Loader)
    return found[0] if found else None


def number(value: object) -> float | None:
    """Return a text as `node.as<double>()` converts it, or None if that is an error."""
    if not isinstance(value, str):
        return None
    if value in _SPECIAL:
        return _SPECIAL[value]
    found = float(value) if _NUMBER.fullmatch(value) else math.inf
    return found if math.isfinite(found) else None


def integer(value: object, lowest: int, highest: int) -> int | None:
    """Return a text as `node.as<int>()` converts it, or None if that is an error, or outside of the bounds.

    As in C, `0x` begins a hexadecimal number, and `0` an octal one. If `lowest` is 0, no sign `-` is allowed.
    """
    found = _INTEGER.fullmatch(value) if isinstance(value, str) else None
    if found is None or len(found[3]) > _DIGITS or (found[1] == "-" and lowest == 0):
        return None
    base = 16 if found[2] else 8 if found[3].startswith("0") else 10
    try:
        result = int(found[1] + found[3], base)
    except ValueError:  # a digit that the base does not have
        return None
    return result if lowest <= result <= highest else None
