"""Select one source of velocity commands by priorities and locks, as twist_mux 3.1 does.

An input is masked while it is expired, or while a lock with a higher priority is active. The unmasked input
with the highest priority is selected. Velocities from other inputs are dropped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros_libraries.nodes.velocities import SILENCE_S

SOURCES: Final = 100
"""Maximum number of inputs, and of locks."""

_PRIORITIES = 255


class InvalidSource(PiprosError, ValueError):
    """An entry of a list of sources is invalid. The text names the entry and the problem."""


@dataclass(slots=True)
class VelocitySource:
    """A topic with velocities, or a lock.

    Attributes:
        timeout_s: time without messages after which the source expires. If <= 0, it never expires.
        priority: from 0 to 255. Inputs with priority 0 are never selected.
        received_s: arrival time of the last message; 0 before the first message.
        is_set: the last value of a lock.
    """

    name: str
    topic: str
    timeout_s: float
    priority: int
    received_s: float = 0.0
    is_set: bool = False

    def is_expired(self, now_s: float) -> bool:
        """Return whether the timeout has passed, or time has moved back behind the last message."""
        return self.timeout_s > 0 and not 0 <= now_s - self.received_s <= self.timeout_s

    def speaks(self, now_s: float) -> bool:
        """Return whether the next message is near: the source will replace the velocity of another one."""
        return not self.is_expired(now_s) and 0 <= now_s - self.received_s <= SILENCE_S

    def __str__(self) -> str:
        return f"(listening to {self.topic} @ {self.timeout_s:.6f}s with priority #{self.priority})"


def source(entry: Any, place: str) -> VelocitySource:
    """Create a source from an entry of `~topics` or `~locks`.

    Raises:
        InvalidSource: the entry is not a mapping, or `name`, `topic`, `timeout` or `priority` is missing or
            invalid.
    """
    if not isinstance(entry, Mapping):
        raise InvalidSource(
            f"{place} must be a mapping with name, topic, timeout and priority, got {entry!r}"
        )

    def value(key: str, kinds: tuple[type, ...], expected: str) -> Any:
        found = entry.get(key)
        if not isinstance(found, kinds) or isinstance(found, bool) or found == "":
            raise InvalidSource(f"{place}: {key} must be {expected}, got {found!r}")
        return found

    timeout_s = float(value("timeout", (int, float), "a number of seconds"))
    if not math.isfinite(timeout_s):
        raise InvalidSource(f"{place}: timeout must be a finite number of seconds, got {timeout_s}")
    priority = value("priority", (int,), "an integer from 0 to 255")
    topic = value("topic", (str,), "the name of a topic")
    if not names.is_legal(topic):
        raise InvalidSource(f"{place}: topic must be the name of a topic, got {topic!r}")
    return VelocitySource(
        value("name", (str,), "a name"), topic, timeout_s, min(max(priority, 0), _PRIORITIES)
    )


def sources(entries: Any, place: str, report: Callable[[str], object]) -> list[VelocitySource]:
    """Return the valid sources of a list, and report each invalid one."""
    if not isinstance(entries, list):
        report(f"{place} must be a list of sources, got {entries!r}")
        return []
    if len(entries) > SOURCES:
        report(f"{place} must have at most {SOURCES} sources, got {len(entries)}")
        return []
    found = []
    for index, entry in enumerate(entries):
        try:
            found.append(source(entry, f"{place}[{index}]"))
        except InvalidSource as error:
            report(str(error))
    return found


class VelocityMux:
    """Selects the input whose velocities are forwarded. The caller provides the time."""

    def __init__(self, inputs: Sequence[VelocitySource], locks: Sequence[VelocitySource]) -> None:
        self.inputs = inputs
        self.locks = locks

    def passes(self, one: VelocitySource, now_s: float) -> bool:
        """Record the arrival of a velocity from an input. Return whether to forward it."""
        one.received_s = now_s
        return self.winner(now_s) is one

    def lock(self, one: VelocitySource, is_set: bool, now_s: float) -> None:
        """Record a new value of a lock."""
        one.is_set, one.received_s = is_set, now_s

    def is_locked(self, one: VelocitySource, now_s: float) -> bool:
        """Return whether a lock is active, that is, set or expired."""
        return one.is_set or one.is_expired(now_s)

    def level(self, now_s: float) -> int:
        """Return the highest priority of the active locks, or 0."""
        return max((lock.priority for lock in self.locks if self.is_locked(lock, now_s)), default=0)

    def is_masked(self, one: VelocitySource, now_s: float) -> bool:
        """Return whether an active lock masks an input."""
        return one.priority < self.level(now_s)

    def unmasked(self, now_s: float) -> list[VelocitySource]:
        """Return the inputs that are neither expired nor masked by a lock."""
        level = self.level(now_s)
        return [each for each in self.inputs if not each.is_expired(now_s) and each.priority >= level]

    def winner(self, now_s: float) -> VelocitySource | None:
        """Return the selected input, or None. If priorities are equal, the first input is selected."""
        free = [each for each in self.unmasked(now_s) if each.priority > 0]
        return max(free, key=lambda each: each.priority, default=None)

    def in_charge(self, moving: VelocitySource, now_s: float) -> VelocitySource | None:
        """Return the input in charge after a velocity from `moving`, or None.

        It is `moving` until it expires, then the selected input, if its next velocity is near.
        """
        if not moving.is_expired(now_s):
            return moving
        selected = self.winner(now_s)
        return selected if selected and selected.speaks(now_s) else None

    def values(self, now_s: float) -> dict[str, str]:
        """Return the state of inputs and locks in the format of twist_mux's diagnostics."""
        free = self.unmasked(now_s)
        rows = [
            (f"velocity {each.name}", f" {'unmasked' if _is_in(each, free) else 'masked'} {each}")
            for each in self.inputs
        ]
        rows += [
            (f"lock {each.name}", f" {'locked' if self.is_locked(each, now_s) else 'free'} {each}")
            for each in self.locks
        ]
        return {**dict(rows), "current priority": str(self.level(now_s))}


def _is_in(one: VelocitySource, sources: Iterable[VelocitySource]) -> bool:
    return any(each is one for each in sources)
