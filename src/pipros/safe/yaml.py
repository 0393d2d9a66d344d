"""Reads YAML as ROS parameter files have it: plain data only, plus angles.

Only the safe loader of PyYAML is behind it, so no document can create objects (CVE-2024-39780). Angles are
written `deg(90)`, `rad(pi/2)`, `!degrees 90` or `!radians pi/2`, and are computed by a small arithmetic
parser (CVE-2024-39289). Aliases that would expand to more than a million values are refused.
"""

from __future__ import annotations

import math
import re
from typing import IO, Any

import yaml

from pipros.errors import PiprosError
from pipros.safe.expr import ExpressionError, arithmetic

VALUES_LIMIT = 1_000_000
"""Values of one document, aliases counted as often as they are used."""

DEPTH_LIMIT = 100
"""Nesting, as the parameter server allows it."""


class YamlError(PiprosError, ValueError):
    """A text is not the YAML that it should be.

    Attributes:
        file: where the text came from.
        line, column: counted from 1; 0 when no single place is to blame.
    """

    def __init__(self, file: str, line: int, column: int, reason: str) -> None:
        self.file = file
        self.line = line
        self.column = column
        self.reason = reason
        place = f":{line}:{column}" if line else ""
        super().__init__(f"{file}{place}: {reason}")


# The loader over libyaml is ten times as quick; both accept the same documents.
_SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_SafeLoader):  # type: ignore[misc]
    """PyYAML's safe loader plus angles. Plain text, numbers and dates are read as in YAML 1.1."""


def _construct_radians(loader: Any, node: Any) -> float:
    return _angle(node, loader.construct_scalar(node), "rad(")


def _construct_degrees(loader: Any, node: Any) -> float:
    return math.radians(_angle(node, loader.construct_scalar(node), "deg("))


def _angle(node: Any, written: str, opening: str) -> float:
    text = written.strip()
    if text.startswith(opening) and text.endswith(")"):
        text = text[len(opening) : -1]
    try:
        return arithmetic(text)
    except ExpressionError as error:
        kind = "degree" if opening == "deg(" else "radian"
        raise yaml.constructor.ConstructorError(
            None, None, f"invalid {kind} value {written}: {error.reason}", node.start_mark
        ) from None


_Loader.add_constructor("!radians", _construct_radians)
_Loader.add_constructor("!degrees", _construct_degrees)
_Loader.add_implicit_resolver("!radians", re.compile(r"rad\([^)]*\)$"), ["r"])
_Loader.add_implicit_resolver("!degrees", re.compile(r"deg\([^)]*\)$"), ["d"])


class _PlainLoader(_SafeLoader):  # type: ignore[misc]
    """PyYAML's safe loader as it is."""


def load(content: str | bytes | IO[Any], file: str = "<string>", *, angles: bool = True) -> Any:
    """The one document in the text; None when it is empty.

    Args:
        angles: whether `deg(…)` and `rad(…)` are computed, as parameter files want it.

    Raises:
        YamlError: for malformed YAML, tags that would create objects, too many values.
    """
    documents = load_all(content, file, angles=angles)
    if len(documents) > 1:
        raise YamlError(file, 0, 0, f"expected a single document, found {len(documents)}")
    return documents[0] if documents else None


def load_all(content: str | bytes | IO[Any], file: str = "<string>", *, angles: bool = True) -> list[Any]:
    """All documents in the text, none when it is empty.

    Raises:
        YamlError: as `load`.
    """
    try:
        documents = list(yaml.load_all(content, _Loader if angles else _PlainLoader))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
        reasons = [reason for reason in (error.context, error.problem) if reason]
        raise YamlError(file, line, column, "invalid YAML: " + ", ".join(reasons)) from None
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:
        raise YamlError(file, 0, 0, f"invalid YAML: {str(error) or 'nested too deeply'}") from None
    _Bounds(file).check(documents, 0)
    return documents


class _Bounds:
    """Counts the values of a document as they would be counted on the wire, where no alias exists."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._count = 0

    def check(self, value: Any, depth: int) -> None:
        self._count += 1
        if self._count > VALUES_LIMIT:
            raise YamlError(self._file, 0, 0, f"expands to more than {VALUES_LIMIT} values")
        if depth > DEPTH_LIMIT:
            raise YamlError(self._file, 0, 0, f"nested more than {DEPTH_LIMIT} deep")
        if isinstance(value, dict):
            for key, part in value.items():
                self.check(key, depth + 1)
                self.check(part, depth + 1)
        elif isinstance(value, (list, tuple, set)):
            for part in value:
                self.check(part, depth + 1)
