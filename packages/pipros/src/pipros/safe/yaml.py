"""Read YAML as in ROS parameter files: plain data and angles.

Only PyYAML's safe loader is used, so a document cannot create objects (CVE-2024-39780). Angles are
written `deg(90)`, `rad(pi/2)`, `!degrees 90` or `!radians pi/2`, and are computed by a small arithmetic
parser (CVE-2024-39289). All values in a text are counted before any value is built (`outline.py`).
"""

from __future__ import annotations

import math
import re
from typing import IO, Any

import yaml

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits, process_limits
from pipros.safe.expr import ExpressionError, arithmetic
from pipros.safe.outline import TooMuch, check_outline

_DIGITS_LIMIT = 4300
"""Maximum number of digits in a number. Python's own limit is the same, but does not apply to base 60
(`1:30:00`).
"""

_USUAL_DIGITS = 20
_LONG_NUMBERS_LIMIT = 1000
"""Maximum number of integers longer than `_USUAL_DIGITS` in a text. Such integers can be chosen so that their
hashes are equal, which makes them slow as dictionary keys.
"""


class YamlError(PiprosError, ValueError):
    """YAML input is invalid, is not plain data, or exceeds a limit.

    Attributes:
        file: the name of the file, or `<string>`.
        line, column: counted from 1; 0 if the error has no position.
    """

    def __init__(self, file: str, line: int, column: int, reason: str) -> None:
        self.file = file
        self.line = line
        self.column = column
        self.reason = reason
        place = f":{line}:{column}" if line else ""
        super().__init__(f"{file}{place}: {reason}")


# The loader based on libyaml is ten times as fast as PyYAML's own; both accept the same documents.
_SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TextLoader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


class _PlainLoader(_SafeLoader):  # type: ignore[misc]
    """PyYAML's safe loader with limits. Plain scalars are read as in YAML 1.1."""

    long_numbers = 0


class _Loader(_PlainLoader):
    """The plain loader, extended with ROS angle values."""


def construct_radians(loader: Any, node: Any) -> float:
    """Return an angle in radians, written as `rad(pi/2)` or `pi/2`.

    Raises:
        yaml.constructor.ConstructorError: the text is not arithmetic.
    """
    return _angle(node, loader.construct_scalar(node), "rad(")


def construct_degrees(loader: Any, node: Any) -> float:
    """Return an angle in radians that is written in degrees, as `deg(90)` or `90`.

    Raises the same errors as `construct_radians`.
    """
    return math.radians(_angle(node, loader.construct_scalar(node), "deg("))


def _angle(node: object, written: str, opening: str) -> float:
    text = written.strip()
    if text.startswith(opening) and text.endswith(")"):
        text = text[len(opening) : -1]
    try:
        return arithmetic(text)
    except ExpressionError as error:
        kind = "degree" if opening == "deg(" else "radian"
        raise yaml.constructor.ConstructorError(
            None, None, f"invalid {kind} value {written}: {error.reason}", getattr(node, "start_mark", None)
        ) from None


def _construct_integer(loader: Any, node: Any) -> Any:
    if len(node.value) > _USUAL_DIGITS:
        loader.long_numbers += 1
        if loader.long_numbers > _LONG_NUMBERS_LIMIT:
            reason = f"more than {_LONG_NUMBERS_LIMIT} numbers are longer than {_USUAL_DIGITS} digits"
            raise yaml.constructor.ConstructorError(None, None, reason, node.start_mark)
        _check_digits(node)
    return loader.construct_yaml_int(node)


def _construct_float(loader: Any, node: Any) -> Any:
    if len(node.value) > _USUAL_DIGITS:
        _check_digits(node)
    return loader.construct_yaml_float(node)


def _check_digits(node: Any) -> None:
    if len(node.value) > _DIGITS_LIMIT:
        reason = f"a number is longer than {_DIGITS_LIMIT} digits"
        raise yaml.constructor.ConstructorError(None, None, reason, node.start_mark)


for _loader in (_PlainLoader, _Loader):
    _loader.add_constructor("tag:yaml.org,2002:int", _construct_integer)
    _loader.add_constructor("tag:yaml.org,2002:float", _construct_float)
_Loader.add_constructor("!radians", construct_radians)
_Loader.add_constructor("!degrees", construct_degrees)
_Loader.add_implicit_resolver("!radians", re.compile(r"rad\([^)]*\)$"), ["r"])
_Loader.add_implicit_resolver("!degrees", re.compile(r"deg\([^)]*\)$"), ["d"])


def load(
    content: str | bytes | IO[Any],
    file: str = "<string>",
    *,
    angles: bool = True,
    limits: Limits | None = None,
) -> Any:
    """Return the single document in the text, or None if the text is empty.

    Args:
        angles: whether `deg(…)` and `rad(…)` are evaluated, as in parameter files.
        limits: defaults to the process-wide limits.

    Raises:
        YamlError: the text is malformed, has several documents or too many values, or a tag would create an
            object.
    """
    documents = load_all(content, file, angles=angles, limits=limits)
    return _only(documents, file)


def _only(documents: list[Any], file: str) -> Any:
    if len(documents) > 1:
        raise YamlError(file, 0, 0, f"expected a single document, found {len(documents)}")
    return documents[0] if documents else None


def load_texts(content: str | bytes, file: str = "<string>", *, limits: Limits | None = None) -> Any:
    """Return the single document in the text, with scalars as strings: `true` is not converted to a boolean.

    Raises:
        YamlError: as in `load`.
    """
    return _only(documents(content, file, _TextLoader, limits), file)


def load_all(
    content: str | bytes | IO[Any],
    file: str = "<string>",
    *,
    angles: bool = True,
    limits: Limits | None = None,
) -> list[Any]:
    """Return all documents in the text, or an empty list if the text is empty.

    Takes the same arguments and raises the same errors as `load`.
    """
    text = content if isinstance(content, (str, bytes)) else content.read()
    return documents(text, file, _Loader if angles else _PlainLoader, limits)


def documents(text: str | bytes, file: str, loader: Any, limits: Limits | None) -> list[Any]:
    """Return all documents in the text as a PyYAML loader constructs them.

    Raises:
        YamlError: as in `load`.
    """
    try:
        check_outline(_SafeLoader, text, limits or process_limits())
        return list(yaml.load_all(text, loader))
    except TooMuch as error:
        raise YamlError(file, error.line, error.column, str(error)) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
        reasons = [reason for reason in (error.context, error.problem) if reason]
        raise YamlError(file, line, column, "invalid YAML: " + ", ".join(reasons)) from None
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:
        raise YamlError(file, 0, 0, f"invalid YAML: {str(error) or 'nested too deeply'}") from None
    except (LookupError, ArithmeticError, AttributeError) as error:  # for example, for `!!bool maybe`
        reason = f"a value does not fit its tag ({error})"
        raise YamlError(file, 0, 0, f"invalid YAML: {reason}") from None
