"""Timestamps of messages in bags, as numbers and as texts."""

from __future__ import annotations

from pipros.msg.time import NS_PER_S, Time

Stamp = tuple[int, int]
"""A timestamp: seconds and nanoseconds."""


def received_at(time_ns: int) -> str:
    """Describe a message by its time of receipt, for error messages."""
    return "the message received at {}.{:09d}".format(*divmod(time_ns, NS_PER_S))


def ns_of(time: Time | Stamp | float | None) -> int | None:
    """Convert a time or a number of seconds to a timestamp (ns); if negative, to 0. None stays None."""
    if time is None:
        return None
    if isinstance(time, tuple):
        time = Time(*time)
    elif not isinstance(time, Time):
        time = Time.from_sec(max(0.0, time))
    return time.to_nsec()
