"""Count the values in YAML input from the parser's events, before any value is built.

Nested lists of aliases can double in size with every line, as can mappings that merge others (`<<: [*a,
*a]`). Deep nesting can exhaust the stack of the C library that builds values. The library's parser, which
produces the events, does not have these problems.
"""

from __future__ import annotations

import codecs
from dataclasses import dataclass
from typing import Any

import yaml

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits

_DIRECTIVES_LIMIT = 100
"""Maximum number of `%TAG` lines in a text, because the parser compares each line with all others."""
_SCANNED_DEPTH = 1000
_TOO_DEEP = "exceeded maximum nesting depth"
"""The nesting limit of the scanner in PyYAML 6.0.4, and the text of its error. The scanner reads ahead of the
events, so this error may occur before `yaml_depth` is exceeded.
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


def check_outline(loader_class: Any, text: str | bytes, limits: Limits) -> None:
    """Check the number of values in all documents, with aliases expanded, and the depth of nesting.

    Args:
        loader_class: the PyYAML loader that produces the events.

    Raises:
        TooMuch: the text exceeds `yaml_values` or `yaml_depth`, has too many `%TAG` directives, or has an
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
    outline = _Outline(limits)
    try:
        while (event := next_event()) is not None:
            if event.__class__ is yaml.ScalarEvent and event.anchor is None:
                outline.values += 1  # the most frequent event
            else:
                outline.count(event)
    except yaml.scanner.ScannerError as error:
        if error.problem != _TOO_DEEP:
            raise
        depth = min(limits.yaml_depth, _SCANNED_DEPTH)
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

    def __init__(self, limits: Limits) -> None:
        self.values = 0
        self._limits = limits
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
        if self.values > self._limits.yaml_values:
            raise TooMuch(f"the text expands to more than {self._limits.yaml_values} values", mark)

    def _check_depth(self, height: int, mark: object) -> None:
        if len(self._open) + height > self._limits.yaml_depth:
            raise TooMuch(f"the text is nested more than {self._limits.yaml_depth} deep", mark)

    def _raise_to(self, height: int) -> None:
        if self._open and self._open[-1].height <= height:
            self._open[-1].height = height + 1
