"""Which topics, services and parameters clients may use: lists of patterns such as `/camera/*`."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable


class Globs:
    """Names that match one of some patterns. Without patterns all names match, as in rosbridge."""

    def __init__(self, patterns: Iterable[str] = ()) -> None:
        self.patterns = tuple(patterns)
        self._pattern = re.compile("|".join(map(fnmatch.translate, self.patterns)))

    @classmethod
    def parse(cls, text: object) -> Globs:
        """Read the value of a parameter: `[/a/*, '/b']` as text, or a list."""
        if isinstance(text, str):
            return cls(filter(None, (part.strip(" '\"") for part in text.strip().strip("[]").split(","))))
        return cls(map(str, text) if isinstance(text, list) else ())

    def allow(self, name: str) -> bool:
        """Return whether a global name matches."""
        return not self.patterns or self._pattern.match(name) is not None
