"""Plan random kills of processes. The same seed gives the same schedule."""

import random
import signal
from collections.abc import Iterable
from dataclasses import dataclass

# Windows has no SIGKILL, but its SIGTERM kills the process just as abruptly.
DEFAULT_SIGNALS = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGKILL", signal.SIGTERM))
"""The signals for a shutdown requested by the user, a shutdown requested by the system, and an exit without
any clean-up.
"""


@dataclass(frozen=True, slots=True)
class Kill:
    """One step of a schedule.

    Attributes:
        after: the number of messages that must arrive before the kill. Schedules do not depend on time.
        victim: the name of the process.
        signal: the signal to send.
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
    """Return `count` kills in random order. Each victim is killed once before any is killed again.

    Args:
        after: the minimum and maximum number of messages between two kills.

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
