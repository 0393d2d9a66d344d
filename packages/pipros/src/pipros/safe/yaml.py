"""Read YAML as in ROS parameter files: plain data and angles.

Only PyYAML's safe loader is used, so a document cannot create objects (CVE-2024-39780). Angles are
written `deg(90)`, `rad(pi/2)`, `!degrees 90` or `!radians pi/2`, and are computed by a small arithmetic
parser (CVE-2024-39289).

Values are counted from the parser's events before any is built. Nested lists of aliases can double in size
with every line, as can mappings that merge others (`<<: [*a, *a]`). Deep nesting can exhaust the stack of the
C library that builds values. The library's parser, which produces the events, does not have these problems.
"""

from __future__ import annotations

import codecs
import math
import re
from dataclasses import dataclass
from typing import IO, Any

import yaml

from pipros.basics.errors import PiprosError
from pipros.safe.expr import arithmetic
from pipros.safe.expr_walk import ExpressionError

YAML_VALUES = 1_000_000
"""Limit: values in a YAML text. Aliases and merged mappings count each time they are used. Beyond it, the
text is refused.
"""
YAML_DEPTH = 100
"""Limit: nesting of lists and mappings in a YAML text. Beyond it, the text is refused."""

_DIGITS_LIMIT = 4300
"""Maximum number of digits in a number. Python's own limit is the same, but does not apply to base 60
(`1:30:00`).
"""

_USUAL_DIGITS = 20
_LONG_NUMBERS_LIMIT = 1000
"""Maximum number of integers longer than `_USUAL_DIGITS` in a text. Such integers can be chosen so that their
hashes are equal, which makes them slow as dictionary keys.
"""


class YamlError(PiprosError, yaml.YAMLError, ValueError):
    """YAML input is invalid, is not plain data, or exceeds a limit.

    This is also an error of PyYAML, which scripts written for genuine rosparam catch.

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
) -> Any:
    """Return the single document in the text, or None if the text is empty.

    Args:
        angles: whether `deg(…)` and `rad(…)` are evaluated, as in parameter files.

    Raises:
        YamlError: the text is malformed, has several documents or too many values, or a tag would create an
            object.
    """
    documents = load_all(content, file, angles=angles)
    return _only(documents, file)


def _only(documents: list[Any], file: str) -> Any:
    if len(documents) > 1:
        raise YamlError(file, 0, 0, f"expected a single document, found {len(documents)}")
    return documents[0] if documents else None


def load_texts(content: str | bytes, file: str = "<string>") -> Any:
    """Return the single document in the text, with scalars as strings: `true` is not converted to a boolean.

    Raises:
        YamlError: as in `load`.
    """
    return _only(documents(content, file, _TextLoader), file)


def load_all(
    content: str | bytes | IO[Any],
    file: str = "<string>",
    *,
    angles: bool = True,
) -> list[Any]:
    """Return all documents in the text, or an empty list if the text is empty.

    Takes the same arguments and raises the same errors as `load`.
    """
    text = content if isinstance(content, (str, bytes)) else content.read()
    return documents(text, file, _Loader if angles else _PlainLoader)


def documents(text: str | bytes, file: str, loader: Any) -> list[Any]:
    """Return all documents in the text as a PyYAML loader constructs them.

    Raises:
        YamlError: as in `load`.
    """
    try:
        check_outline(_SafeLoader, text)
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
    except (LookupError, ArithmeticError) as error:  # for example, for `!!bool maybe`
        raise YamlError(file, 0, 0, f"invalid YAML: a value does not fit its tag ({error})") from None
    except AttributeError:  # for `!!timestamp soon`, whose text says nothing about the value
        raise YamlError(file, 0, 0, "invalid YAML: a value does not fit its tag") from None


_DIRECTIVES_LIMIT = 100
"""Maximum number of `%TAG` lines in a text, because the parser compares each line with all others."""
_SCANNED_DEPTH = 1000
_TOO_DEEP = "exceeded maximum nesting depth"
"""The nesting limit of the scanner in PyYAML 6.0.4, and the text of its error. The scanner reads ahead of the
events, so this error may occur before `YAML_DEPTH` is exceeded.
"""


class TooMuch(PiprosError, ValueError):
    """YAML input would expand to too many values, or is nested too deeply.

    Attributes:
        line, column: counted from 1; 0 if the error has no position.
    """

    def __init__(self, reason: str, mark: Any = None) -> None:
        super().__init__(reason)
        self.line = mark.line + 1 if mark else 0
        self.column = mark.column + 1 if mark else 0


def check_outline(loader_class: Any, text: str | bytes) -> None:
    """Check the number of values in all documents, with aliases expanded, and the depth of nesting.

    Args:
        loader_class: the PyYAML loader that produces the events.

    Raises:
        TooMuch: the text exceeds `YAML_VALUES` or `YAML_DEPTH`, has too many `%TAG` directives, or has an
            alias inside the value that it refers to.
        yaml.YAMLError: the text is malformed.
    """
    if isinstance(text, bytes) and text.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = text.decode("utf-16")
    directives = text.count("%TAG") if isinstance(text, str) else text.count(b"%TAG")
    if directives > _DIRECTIVES_LIMIT:
        raise TooMuch(f"the text has more than {_DIRECTIVES_LIMIT} %TAG directives")
    loader = loader_class(text)
    next_event = loader.get_event
    outline = _Outline()
    try:
        while (event := next_event()) is not None:
            if event.__class__ is yaml.ScalarEvent and event.anchor is None:
                outline.values += 1  # the most frequent event
            else:
                outline.count(event)
    except yaml.scanner.ScannerError as error:
        if error.problem != _TOO_DEEP:
            raise
        depth = min(YAML_DEPTH, _SCANNED_DEPTH)
        raise TooMuch(f"the text is nested more than {depth} deep", error.problem_mark) from None
    finally:
        loader.dispose()
    outline.check_values()


@dataclass(slots=True)
class _Open:
    """A list or mapping that has not ended yet. Its height is 1 more than that of its tallest element."""

    anchor: str | None
    values_before: int
    height: int = 1


class _Outline:
    """The anchors in the current document with their sizes, and the number of values so far.

    The number of values is checked at the start of each list or mapping, and at each alias.
    """

    def __init__(self) -> None:
        self.values = 0
        self._open: list[_Open] = []
        self._anchored: dict[str | None, tuple[int, int] | None] = {}
        """The number of values and the height for each anchor; None until the anchored value has ended."""

    def count(self, event: object) -> None:
        """Count the next event from the text. Raises the same errors as `check_outline`."""
        match event:
            case yaml.CollectionStartEvent():
                self._check_depth(1, event.start_mark)
                self.check_values(event.start_mark)
                self._open.append(_Open(event.anchor, self.values))
                self._anchored[event.anchor] = None
                self.values += 1
            case yaml.CollectionEndEvent():
                ended = self._open.pop()
                self._anchored[ended.anchor] = self.values - ended.values_before, ended.height
                self._raise_to(ended.height)
            case yaml.AliasEvent():
                size = self._anchored.get(event.anchor, (1, 0))  # the loader refuses unknown aliases
                if size is None:
                    raise TooMuch(f"*{event.anchor} is inside the value that it refers to", event.start_mark)
                values, height = size
                self._check_depth(height, event.start_mark)
                self._raise_to(height)
                self.values += values
                self.check_values(event.start_mark)
            case yaml.ScalarEvent():
                self._anchored[event.anchor] = 1, 0
                self.values += 1
            case yaml.DocumentStartEvent():
                self._anchored.clear()

    def check_values(self, mark: object = None) -> None:
        if self.values > YAML_VALUES:
            raise TooMuch(f"the text expands to more than {YAML_VALUES} values", mark)

    def _check_depth(self, height: int, mark: object) -> None:
        if len(self._open) + height > YAML_DEPTH:
            raise TooMuch(f"the text is nested more than {YAML_DEPTH} deep", mark)

    def _raise_to(self, height: int) -> None:
        if self._open and self._open[-1].height <= height:
            self._open[-1].height = height + 1
