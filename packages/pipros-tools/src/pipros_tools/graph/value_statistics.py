"""Statistics of the numbers in messages. Performs no I/O."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros.msg.time import TVal

FIELDS: Final = 200
"""Maximum number of fields with statistics."""


def numbers_in(value: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers in a value with their fields' names. Elements of an array share one name."""
    if isinstance(value, (bool, int, float)):
        yield name or "value", float(value)
    elif isinstance(value, TVal):
        yield name or "value", value.to_sec()
    elif hasattr(value, "_slot_types"):
        for field in value.__slots__:
            yield from numbers_in(getattr(value, field), f"{name}.{field}" if name else field)
    elif isinstance(value, (list, tuple)) or hasattr(value, "tolist"):
        for each in value:
            yield from numbers_in(each, f"{name}[]")


@dataclass(slots=True)
class Summary:
    """Statistics of the values of a field. NaN and infinity count only in `not_finite`."""

    count: int = 0
    not_finite: int = 0
    total: float = 0.0
    squares: float = 0.0
    minimum: float = math.inf
    maximum: float = -math.inf
    first: float = math.nan
    last: float = math.nan

    def add(self, value: float) -> None:
        if not math.isfinite(value):
            self.not_finite += 1
            return
        if not self.count:
            self.first = value
        self.count += 1
        delta = value - self.first  # relative to the first value, so that timestamps keep their precision
        self.total += delta
        self.squares += delta * delta
        self.minimum, self.maximum = min(self.minimum, value), max(self.maximum, value)
        self.last = value

    def as_row(self, field: str) -> Mapping[str, Any]:
        if not self.count:
            return {"field": field, "values": 0, "not_finite": self.not_finite}
        mean = self.total / self.count
        return {
            "field": field,
            "values": self.count,
            "not_finite": self.not_finite,
            "min": self.minimum,
            "max": self.maximum,
            "mean": self.first + mean,
            "deviation": math.sqrt(max(self.squares / self.count - mean * mean, 0.0)),
            "first": self.first,
            "last": self.last,
        }


def summaries(values: Iterable[Any]) -> list[Mapping[str, Any]]:
    """Return the statistics of the numbers in the values, by field, for at most `FIELDS` fields."""
    found: dict[str, Summary] = {}
    for value in values:
        for field, number in numbers_in(value):
            if field in found or len(found) < FIELDS:
                found.setdefault(field, Summary()).add(number)
    return [found[field].as_row(field) for field in found]
