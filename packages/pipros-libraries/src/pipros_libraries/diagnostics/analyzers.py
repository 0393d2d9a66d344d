"""Analyzers of the aggregator: each accepts certain statuses and summarizes them.

Analyzers are configured by the parameter `analyzers`; see http://wiki.ros.org/diagnostic_aggregator. Times
are in seconds; all calls must use the same clock.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isinf
from typing import Any, Protocol

from pipros.basics.errors import PiprosError
from pipros_libraries.diagnostics.items import ERROR, OK, STALE, ComponentStatus, Item, level_name
from pipros_libraries.diagnostics.name_patterns import NamePatterns

TIMEOUT_S = 5.0
"""Time without an update after which an item is stale, unless `timeout` is set."""
ITEM_LIMIT = 10_000
"""Maximum number of items in one analyzer. Limited because any peer can choose item names."""


@dataclass(frozen=True, slots=True)
class Criteria:
    """Criteria for the names that an analyzer accepts. A name must satisfy at least one of them."""

    names: frozenset[str] = frozenset()
    starts: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    patterns: NamePatterns = field(default_factory=lambda: NamePatterns(()))

    def __bool__(self) -> bool:
        return bool(self.names or self.starts or self.parts or self.patterns)

    def match(self, name: str) -> bool:
        return (
            name in self.names
            or name.startswith(self.starts)
            or any(part in name for part in self.parts)
            or self.patterns.match(name)
        )


class Items:
    """The items of one analyzer, and the status that summarizes them."""

    def __init__(
        self,
        name: str,
        path: str,
        *,
        expected: Sequence[str] = (),
        prefixes: Sequence[str] = (),
        timeout_s: float = TIMEOUT_S,
        count: int = -1,
        discards_stale: bool = False,
    ) -> None:
        """Create the list of items, which initially contains only the expected items.

        Args:
            expected: the names of items that are reported as missing until they arrive.
            prefixes: prefixes to remove from the names of reported items.
            timeout_s: time without an update after which an item is stale; 0 for never.
            count: the required number of items; -1 for any.
            discards_stale: whether to remove stale items instead of reporting them.
        """
        self.name, self.path = name, path
        self._prefixes = tuple(prefixes)
        self._timeout_s, self._count, self._discards_stale = timeout_s, count, discards_stale
        self._items = {item: Item(ComponentStatus(item)) for item in expected}

    def analyze(self, status: ComponentStatus, now_s: float) -> bool:
        if status.name not in self._items and len(self._items) >= ITEM_LIMIT:
            return False
        self._items[status.name] = Item(status, now_s)
        return True

    def report(self, now_s: float) -> list[ComponentStatus]:
        """Return the summary and the items.

        The summary has the highest level of the items, but is an error if only some of them are stale, or if
        their number differs from a positive `count`. It is stale if there are no items, unless `count` is 0.
        """
        reported, values, levels = [], [], []
        for name, item in list(self._items.items()):
            is_stale = self._is_stale(item, now_s)
            if is_stale and self._discards_stale:
                del self._items[name]
                continue
            status = item.below(self.path, self._prefixes, is_stale)
            reported.append(status)
            values.append((name, status.message))
            levels.append(status.level)
        level = summed_up(levels) if levels or self._count == 0 else STALE
        message = level_name(level)
        if self._count > 0 and len(reported) != self._count:
            level = max(level, ERROR)
            message = f"Expected {self._count}, found {len(reported)}"
        return [ComponentStatus(self.path, level, message, values=tuple(values)), *reported]

    def _is_stale(self, item: Item, now_s: float) -> bool:
        if item.updated_s is None:
            return True
        return self._timeout_s > 0 and not 0 <= now_s - item.updated_s <= self._timeout_s


def summed_up(levels: Sequence[int]) -> int:
    """Return the highest level, or OK if `levels` is empty. STALE counts as ERROR unless all are STALE.

    >>> summed_up([0, 1]), summed_up([3, 0]), summed_up([3, 3]), summed_up([])
    (1, 2, 3, 0)
    """
    highest = max(levels, default=OK)
    return ERROR if highest == STALE and min(levels) != STALE else highest


DEPTH_LIMIT = 20
"""Maximum nesting depth of groups."""

SLOW_REGEX = "A regex takes too long and is no longer used"


class BadAnalyzer(PiprosError, ValueError):
    """The parameters of an analyzer are invalid.

    Attributes:
        summary: a short description, published as the message of a status.
    """

    def __init__(self, reason: str, summary: str = "Analyzer init failed") -> None:
        super().__init__(reason)
        self.summary = summary


class Analyzer(Protocol):
    """Interface of analyzers. An analyzer accepts certain statuses and reports them below its path.

    Attributes:
        name: the last component of the path.
        path: the full path.
    """

    name: str
    path: str

    def match(self, name: str) -> bool:
        """Return whether the analyzer accepts statuses with the given name."""

    def analyze(self, status: ComponentStatus, now_s: float) -> bool:
        """Process a status whose name `match` accepts. Return whether the status was accepted."""

    def report(self, now_s: float) -> list[ComponentStatus]:
        """Return the analyzer's own status, which is named `path`, and the statuses of its items.

        The list may be empty.
        """


class GenericAnalyzer(Items):
    """Analyzer that accepts the statuses selected by its parameters, and reports all of them."""

    def __init__(self, name: str, path: str, criteria: Criteria, **more: Any) -> None:
        super().__init__(name, path, **more)
        self._criteria = criteria

    def match(self, name: str) -> bool:
        return self._criteria.match(name)

    def report(self, now_s: float) -> list[ComponentStatus]:
        """Like `Items.report`, but add an error if a regular expression takes too long."""
        header, *reported = super().report(now_s)
        if self._criteria.patterns.slow:
            values = tuple((SLOW_REGEX, pattern) for pattern in self._criteria.patterns.slow)
            header = ComponentStatus(header.name, ERROR, SLOW_REGEX, values=(*header.values, *values))
        return [header, *reported]


class DowngradeAnalyzer(GenericAnalyzer):
    """Analyzer that reports all statuses as OK, with their messages."""

    def report(self, now_s: float) -> list[ComponentStatus]:
        return [replace(each, level=OK) for each in super().report(now_s)]


class DiscardAnalyzer(GenericAnalyzer):
    """Analyzer that accepts statuses like a GenericAnalyzer, but reports nothing."""

    def report(self, now_s: float) -> list[ComponentStatus]:
        del now_s
        return []


class IgnoreAnalyzer:
    """Analyzer that accepts and reports nothing, regardless of its parameters."""

    def __init__(self, name: str, path: str) -> None:
        self.name, self.path = name, path

    def match(self, name: str) -> bool:
        del name
        return False

    def analyze(self, status: ComponentStatus, now_s: float) -> bool:
        del status, now_s
        return False

    def report(self, now_s: float) -> list[ComponentStatus]:
        del now_s
        return []


class AnalyzerGroup:
    """The analyzers below one path, sorted by their keys in the parameters.

    A status is passed to each analyzer that accepts it.

    Attributes:
        problems: maps the keys of analyzers that could not be created to the errors.
    """

    def __init__(self, name: str, path: str, parameters: Mapping[str, Any], depth: int = 0) -> None:
        """Create the group's analyzers. Invalid analyzers are added to `problems`.

        Raises:
            BadAnalyzer: groups are nested too deeply.
        """
        if depth > DEPTH_LIMIT:
            raise BadAnalyzer(f"analyzer groups are nested more than {DEPTH_LIMIT} deep")
        self.name, self.path = name, path
        self.problems: dict[str, BadAnalyzer] = {}
        self._analyzers: list[Analyzer] = []
        for key, described in sorted(parameters.items(), key=str):
            try:
                self._analyzers.append(analyzer_of(path, described, depth))
            except BadAnalyzer as error:
                self.problems[str(key)] = error

    @property
    def groups(self) -> list[AnalyzerGroup]:
        """The groups among the analyzers."""
        return [analyzer for analyzer in self._analyzers if isinstance(analyzer, AnalyzerGroup)]

    def match(self, name: str) -> bool:
        return any(analyzer.match(name) for analyzer in self._analyzers)

    def analyze(self, status: ComponentStatus, now_s: float) -> bool:
        taken = [
            analyzer.analyze(status, now_s) for analyzer in self._analyzers if analyzer.match(status.name)
        ]
        return any(taken)

    def report(self, now_s: float) -> list[ComponentStatus]:
        values, levels, reported = [], [], []
        for analyzer in self._analyzers:
            of_one = analyzer.report(now_s)
            reported += of_one
            for status in of_one:
                if status.name == analyzer.path:
                    values.append((analyzer.name, status.message))
                    levels.append(status.level)
        for key, error in self.problems.items():
            reported.append(
                ComponentStatus(f"{self.path}/{key}", ERROR, error.summary, values=(("reason", str(error)),))
            )
            values.append((key, error.summary))
            levels.append(ERROR)
        if not self.path:
            return reported
        level = summed_up(levels)
        message = level_name(level)
        if not self._analyzers and not self.problems:
            level, message = ERROR, "No analyzers"
        return [ComponentStatus(self.path, level, message, values=tuple(values)), *reported]


class OtherAnalyzer(Items):
    """Analyzer for statuses that no other analyzer has accepted. Optionally reports them as errors."""

    def __init__(self, path: str, as_errors: bool) -> None:
        super().__init__("Other", f"{path}/Other", discards_stale=True)
        self._as_errors = as_errors

    def report(self, now_s: float) -> list[ComponentStatus]:
        header, *reported = super().report(now_s)
        if not reported:
            return []
        if self._as_errors:
            message = 'Unanalyzed items found in "Other"'
            header = ComponentStatus(header.name, ERROR, message, values=header.values)
        return [header, *reported]


def analyzer_of(base: str, parameters: Any, depth: int = 0) -> Analyzer:
    """Create an analyzer from its parameters, below the path of its group.

    Raises:
        BadAnalyzer: the parameters are invalid.
    """
    if not isinstance(parameters, Mapping):
        raise BadAnalyzer(f"an analyzer must be a dictionary of parameters, got {parameters!r}")
    kind = parameters.get("type")
    if not isinstance(kind, str) or not kind:
        raise BadAnalyzer("missing required parameter 'type'", "No Analyzer type given")
    make = _MAKERS.get(kind.removeprefix("diagnostic_aggregator/"))
    if make is None:
        raise BadAnalyzer(
            f"unknown analyzer type {kind}; known types are {', '.join(_MAKERS)}. Analyzers written in C++ "
            "can only be loaded by Noetic's aggregator_node",
            "Pluginlib exception loading analyzer",
        )
    name = parameters.get("path")
    if kind.endswith("IgnoreAnalyzer"):
        name = name or "ignored"
    if not isinstance(name, str) or not name.strip("/"):
        raise BadAnalyzer(f"the parameter 'path' must be a name, got {name!r}")
    return make(name.strip("/"), f"{base}/{name.strip('/')}", parameters, depth)


def _generic(
    kind: type[GenericAnalyzer], name: str, path: str, parameters: Mapping[str, Any]
) -> GenericAnalyzer:
    removed_where_found = _texts(parameters, "find_and_remove_prefix")
    expected = _texts(parameters, "expected")
    try:
        patterns = NamePatterns(_texts(parameters, "regex"))
    except ValueError as error:
        raise BadAnalyzer(f"the parameter 'regex' of {path} is invalid: {error}") from None
    criteria = Criteria(
        names=frozenset([*_texts(parameters, "name"), *expected]),
        starts=(*_texts(parameters, "startswith"), *removed_where_found),
        parts=tuple(_texts(parameters, "contains")),
        patterns=patterns,
    )
    if not criteria:
        raise BadAnalyzer(
            f"{path} matches no status: it needs startswith, contains, name, expected, regex or "
            "find_and_remove_prefix"
        )
    return kind(
        name,
        path,
        criteria,
        expected=expected,
        prefixes=[*_texts(parameters, "remove_prefix"), *removed_where_found],
        timeout_s=_number(parameters, "timeout", TIMEOUT_S),
        count=_count(parameters, "num_items"),
        discards_stale=bool(parameters.get("discard_stale", False)),
    )


def _group(name: str, path: str, parameters: Mapping[str, Any], depth: int) -> AnalyzerGroup:
    inner = parameters.get("analyzers", {})
    if not isinstance(inner, Mapping):
        raise BadAnalyzer(f"'analyzers' of {path} must be a dictionary, got {inner!r}")
    return AnalyzerGroup(name, path, inner, depth + 1)


_MAKERS: Mapping[str, Callable[[str, str, Mapping[str, Any], int], Analyzer]] = {
    "GenericAnalyzer": lambda name, path, found, _: _generic(GenericAnalyzer, name, path, found),
    "DiscardAnalyzer": lambda name, path, found, _: _generic(DiscardAnalyzer, name, path, found),
    "DowngradeAnalyzer": lambda name, path, found, _: _generic(DowngradeAnalyzer, name, path, found),
    "IgnoreAnalyzer": lambda name, path, *_: IgnoreAnalyzer(name, path),
    "AnalyzerGroup": _group,
}


def _texts(parameters: Mapping[str, Any], key: str) -> list[str]:
    """Return a parameter, which must be a string or a list of strings, as a list."""
    value = parameters.get(key, [])
    texts = [value] if isinstance(value, str) else value
    if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        raise BadAnalyzer(f"the parameter {key!r} must be a string or a list of strings, got {value!r}")
    return texts


def _number(parameters: Mapping[str, Any], key: str, default: float) -> float:
    value = parameters.get(key, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value:
        raise BadAnalyzer(f"the parameter {key!r} must be a number, got {value!r}")
    return value


def _count(parameters: Mapping[str, Any], key: str) -> int:
    number = _number(parameters, key, -1)
    if isinf(number):
        raise BadAnalyzer(f"the parameter {key!r} must be finite, got {number}")
    return int(number)
