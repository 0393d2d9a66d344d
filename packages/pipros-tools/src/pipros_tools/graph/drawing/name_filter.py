"""Filters for the names of nodes and topics."""

from __future__ import annotations


class NameFilter:
    """Comma-separated name patterns. A leading `-` excludes names, and `*` matches any characters.

    A pattern without `*` matches a name and everything below it; its leading slash may be left out.
    rqt_graph's `.*` is equivalent to `*`.

    >>> keeps = NameFilter("/robot, -/robot/camera*")
    >>> [name for name in ("/robot", "/robot/scan", "/robot/camera_left", "/robots") if keeps(name)]
    ['/robot', '/robot/scan']
    """

    def __init__(self, text: str) -> None:
        patterns = [pattern.strip() for pattern in text.split(",")]
        excluded = [pattern[1:].strip() for pattern in patterns if pattern.startswith("-")]
        self._excluded = [_Pattern(pattern) for pattern in excluded if pattern]
        self._included = [
            _Pattern(pattern) for pattern in patterns if pattern and not pattern.startswith("-")
        ]

    def __call__(self, name: str) -> bool:
        if any(excluded.matches(name) for excluded in self._excluded):
            return False
        return not self._included or any(included.matches(name) for included in self._included)


class _Pattern:
    """One pattern, split at its stars, so that matching takes linear time."""

    def __init__(self, pattern: str) -> None:
        self._parts = pattern.replace(".*", "*").split("*")

    def matches(self, name: str) -> bool:
        first, *rest = self._parts
        if not rest:
            first = "/" + first.lstrip("/")
            return name == first or name.startswith(first.rstrip("/") + "/")
        *middle, last = rest
        if not name.startswith(first) or not name.endswith(last) or len(name) < len(first) + len(last):
            return False
        at, end = len(first), len(name) - len(last)
        for part in middle:
            found = name.find(part, at, end)
            if found < 0:
                return False
            at = found + len(part)
        return True
