"""Times that users of notebooks write: numbers, texts, and those of `datetime`, numpy and pandas."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from datetime import date, datetime, timedelta, timezone
from typing import Any, TypeAlias

import numpy as np

from pipros.msg.time import Time
from pipros_tools.bag.times import ns_of

Moment: TypeAlias = "Time | float | str | date | np.datetime64 | None"
"""A `rospy.Time`, seconds since 1970, a text such as `2014-01-01 12:00`, or a time of `datetime`, numpy or
pandas.

Texts and times without a time zone are in UTC.
"""

_DATE = re.compile(r"\d{4}-\d\d(-\d\d([T ]\d\d:?.*)?)?")
_ZONE = re.compile(r"^[^:]*:.*[+-]\d\d:\d\d$")
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


def moment_ns(moment: Moment) -> int | None:
    """Return a moment in ns since 1970; 0 if it is earlier. None stays None.

    Raises:
        ValueError: a text is not a date, or a number is not finite.
        TypeError: the value is not a moment.
    """
    value: Any = moment
    is_number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    is_nothing = isinstance(value, datetime | np.datetime64) and value != value  # NaT
    if is_nothing or (is_number and not np.isfinite(value)):
        raise ValueError(f"a time must be finite, got {moment!r}")
    if value is None or is_number or isinstance(value, Time | tuple):
        return ns_of(value if isinstance(value, Time | tuple) or value is None else float(value))
    if isinstance(value, str):
        value = _of_text(value)
    if isinstance(value, np.datetime64) or type(value) is date:
        return max(0, int(np.datetime64(value).astype("datetime64[ns]").astype(np.int64)))
    if not isinstance(value, datetime):
        raise TypeError(f"a time must be seconds, a rospy.Time, a date or a text, got {moment!r}")
    aware = value if value.tzinfo else value.replace(tzinfo=timezone.utc)
    ns = (aware - _EPOCH) // timedelta(microseconds=1) * 1000
    return max(0, int(ns) + int(getattr(value, "nanosecond", 0)))  # a pandas.Timestamp has nanoseconds


def _of_text(text: str) -> datetime | np.datetime64:
    found = text.strip()
    convert: Callable[[str], datetime | np.datetime64] = np.datetime64
    if _ZONE.search(found):
        convert = datetime.fromisoformat
    if _DATE.fullmatch(found):
        with suppress(ValueError):
            return convert(found.removesuffix("Z"))
    raise ValueError(f"a time must be like 2014-01-01 or 2014-01-01T12:30:00.5, got {text!r}")
