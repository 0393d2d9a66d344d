"""Which process is killed when, and by what: pure, and the same for the same seed."""

from __future__ import annotations

import random
import signal
from collections.abc import Iterable
from dataclasses import dataclass

# Windows has no SIGKILL; its SIGTERM ends a process as hard.
DEFAULT_SIGNALS = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGKILL", signal.SIGTERM))
"""An orderly end by a person, one by the system, and one without a chance to say anything."""


@dataclass(frozen=True, slots=True)
class Kill:
    """One step of a schedule.

    Attributes:
        after: how many messages are to arrive before it, so that nobody waits for time.
        victim: the name of the process.
        signal: what it is sent.
    """

    after: int
    victim: str
    signal: signal.Signals


def kill_schedule(
    seed: int,
    victims: Iterable[str],
    count: int,
    *,
    after: tuple[int, int] = (1, 20),
    signals: Iterable[signal.Signals] = DEFAULT_SIGNALS,
) -> list[Kill]:
    """So many kills of the victims in random order, each of them once before any of them twice.

    Args:
        after: least and most messages between two kills.

    Raises:
        ValueError: there is no victim or no signal.
    """
    chance = random.Random(seed)  # noqa: S311
    names, numbers = sorted(victims), list(signals)
    if not names or not numbers:
        raise ValueError(f"victims and signals must not be empty, got {names} and {numbers}")
    turn: list[str] = []
    schedule = []
    for _ in range(count):
        if not turn:
            turn = chance.sample(names, len(names))
        schedule.append(Kill(chance.randint(*after), turn.pop(), chance.choice(numbers)))
    return schedule
