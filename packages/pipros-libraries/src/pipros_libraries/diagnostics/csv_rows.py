"""Convert recorded statuses to CSV, with one file per status name, in the format of `diagnostic_analysis`."""

from __future__ import annotations

import time
from collections.abc import Iterable

from pipros_libraries.diagnostics.items import ComponentStatus

NAME_LIMIT = 200
"""Maximum length of a file name without number and suffix. Limited because any peer can choose names."""

_HEAD = ("Timestamp", "Level", "Message", "Hardware ID")
_IN_NAMES = str.maketrans({" ": "_", "/": "__", **dict.fromkeys("()#.\0\n")})
_IN_CELLS = str.maketrans({",": " ", "\n": "  ", "\r": " "})


def file_names(names: Iterable[str]) -> dict[str, str]:
    """Return a unique CSV file name for each status name.

    >>> file_names(["Motor (left): a/b", "Motor left: a/b"])
    {'Motor (left): a/b': 'Motor_left:_a__b.csv', 'Motor left: a/b': 'Motor_left:_a__b_2.csv'}
    """
    chosen: dict[str, str] = {}
    taken = set[str]()
    for name in names:
        stem = name.translate(_IN_NAMES)[:NAME_LIMIT] or "status"
        found, number = stem, 1
        while found in taken:
            number += 1
            found = f"{stem}_{number}"
        taken.add(found)
        chosen[name] = f"{found}.csv"
    return chosen


class CsvColumns:
    """The keys of a status's values, in order of first occurrence."""

    def __init__(self) -> None:
        self._places: dict[str, int] = {}

    def add(self, status: ComponentStatus) -> None:
        for key, _ in status.values:
            self._places.setdefault(key, len(self._places))

    def header(self) -> str:
        """Return the header line of the file."""
        keys = [key.replace(",", "").replace("\n", " ").replace("\r", " ") for key in self._places]
        return ",".join([*_HEAD, *keys]) + "\n"

    def row(self, status: ComponentStatus, stamp_s: float) -> str:
        """Return a row of the file, with the time in the local time zone and a cell for each known key."""
        self.add(status)
        cells = [""] * len(self._places)
        for key, value in status.values:
            cells[self._places[key]] = value.translate(_IN_CELLS)
        at = time.strftime("%Y/%m/%d %H:%M:%S", time.localtime(stamp_s))
        message, hardware = (
            status.message.translate(_IN_CELLS).strip(),
            status.hardware_id.translate(_IN_CELLS),
        )
        return ",".join([at, str(status.level), message, hardware, *cells]) + "\n"
