"""Query the state of a fleet, for `pipros fleet list`, `info`, `top` and `history`."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros_fleet import keys
from pipros_fleet.directory import Directory, from_json, read_json
from pipros_fleet.history_files import HistoryFile, read_rows
from pipros_fleet.zenoh_session import SessionLink

REQUEST_S: Final = 3.0
HISTORY_S: Final = 60.0
"""Timeout for a router to list its files, or to send one of them over a slow link."""


@dataclass(frozen=True, slots=True)
class Present:
    """A running instance of a member's agent."""

    member: str
    version: int
    instance: str


@dataclass(frozen=True, slots=True)
class Counters:
    """Snapshot of a member's counters.

    Attributes:
        sent: the number of messages, bytes, dropped messages, and messages discarded while the link was down,
            for each key.
        received: the number of messages, bytes, lost messages and malformed messages, for each sender and
            topic.
        round_trip_s: duration of the request.
    """

    member: str
    sent: Mapping[str, tuple[int, int, int, int]]
    received: Mapping[str, tuple[int, int, int, int]]
    round_trip_s: float


def present(link: SessionLink) -> list[Present]:
    """Return all running agent instances, sorted by member."""
    found = (keys.read_live(key) for key in link.live_keys(keys.live("*"), REQUEST_S))
    return [Present(member, version, instance) for member, version, instance in sorted(filter(None, found))]


def directory_of(link: SessionLink, member: str) -> Directory | None:
    """Return a member's directory, or None if the member does not respond.

    Raises:
        PiprosError: the directory is malformed or too large.
    """
    answers = link.get(keys.directory(member), timeout_s=REQUEST_S)
    return from_json(answers[-1].payload, member) if answers else None


def counters_of(link: SessionLink, member: str) -> Counters | None:
    """Return a member's counters, or None if the response is missing or malformed."""
    begin_s = time.monotonic()
    try:
        answers = link.get(keys.statistics(member), timeout_s=REQUEST_S)
    except PiprosError:
        return None
    passed_s = time.monotonic() - begin_s
    match read_json(answers[-1].payload) if answers else None:
        case {"sent": dict(sent), "received": dict(received)}:
            return Counters(member, _rows(sent), _rows(received), passed_s)
    return None


def history_of(link: SessionLink, member: str) -> list[HistoryFile] | None:
    """Return a router's recordings of a member, oldest first, or None if no router keeps a history.

    Raises:
        LinkFailed: the router cannot read its files, or has too many requests.
    """
    answers = link.get(keys.history(member), timeout_s=HISTORY_S)
    return list(read_rows(read_json(answers[-1].payload))) if answers else None


def history_file(link: SessionLink, member: str, name: str) -> bytes | None:
    """Return the content of a recorded file, or None if no router has it, for example because it was deleted.

    Raises:
        LinkFailed: a router refuses the request, for example because it has too many requests.
    """
    answers = link.get(keys.history(member, name), timeout_s=HISTORY_S)
    return answers[-1].payload if answers else None


def rates(before: Counters, after: Counters, passed_s: float) -> Iterator[tuple[str, float, float, int, int]]:
    """Yield the name, messages/s, bytes/s, and totals of dropped and unsent messages for each sent topic."""
    for key, row in sorted(after.sent.items()):
        first = before.sent.get(key, (0, 0, 0, 0))
        parts = keys.parts(key)
        name = "?" if parts is None else _name_of(*parts)
        yield name, (row[0] - first[0]) / passed_s, (row[1] - first[1]) / passed_s, row[2], row[3]


def _name_of(member: str, kind: str, rest: list[str]) -> str:
    """Return a topic's name for a terminal.

    >>> _name_of("r1", "t", ["a%1b%5b2J"])
    '/r1/a\\\\x1b[2J'
    """
    if kind == "in" and rest:
        member, *rest = rest
    return printable(f"/{member}{keys.unmangled('/'.join(rest))}")


def _rows(values: Mapping[Any, Any]) -> dict[str, tuple[int, int, int, int]]:
    """Return counters by name, without those that are malformed.

    >>> _rows({"a": [1, 2, 3, 4], "b": [10**400, 0, 0, 0]})
    {'a': (1, 2, 3, 4)}
    """
    found = {}
    for name, row in values.items():
        match row:
            case [int(a), int(b), int(c), int(d)] if max(map(abs, row)) < 2**63:
                found[printable(name)] = a, b, c, d
    return found
