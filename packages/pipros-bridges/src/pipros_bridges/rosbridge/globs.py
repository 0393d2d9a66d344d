"""Patterns such as `/camera/*` for the topics, services and parameters that clients may use."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable


class Globs:
    """The names that match at least one pattern; all names if there are no patterns, as in rosbridge."""

    def __init__(self, patterns: Iterable[str] = ()) -> None:
        self.patterns = tuple(patterns)
        self._pattern = re.compile("|".join(map(fnmatch.translate, self.patterns)))

    @classmethod
    def parse(cls, text: object) -> Globs:
        """Parse a parameter's value: a string such as `[/a/*, '/b']`, or a list."""
        if isinstance(text, str):
            return cls(filter(None, (part.strip(" '\"") for part in text.strip().strip("[]").split(","))))
        return cls(map(str, text) if isinstance(text, list) else ())

    def allow(self, name: str) -> bool:
        """Return whether a global name is allowed."""
        return not self.patterns or self._pattern.match(name) is not None
