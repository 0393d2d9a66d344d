"""Open a bag for a browser, which may wait long for a bag without an index, and describe what is in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipros.msg.time import NS_PER_S
from pipros_page.bags.tracks import BINS, tracks
from pipros_page.bounded_list import bounded_list
from pipros_tools.bag.errors import BagError, NotIndexed
from pipros_tools.bag.opening import is_mcap, open_bag
from pipros_tools.bag.reader import BagReader


class OpeningCancelled(BagError):
    """The browser has stopped waiting for the bag to open."""


@dataclass(slots=True)
class OpeningProgress:
    """Progress of reading a bag without an index.

    Attributes:
        share: the part that has been read, from 0 to 1.
        is_cancelled: whether to stop reading.
    """

    share: float = 0.0
    is_cancelled: bool = False

    def note(self, share: float) -> None:
        """Note that this part has been read. Raise `OpeningCancelled` if the browser no longer waits."""
        self.share = round(min(share, 1.0), 3)
        if self.is_cancelled:
            raise OpeningCancelled("cancelled")


def open_with_progress(path: Path, progress: OpeningProgress) -> BagReader:
    """Open a bag. If it has no index, read it as a whole.

    Raises:
        BagError: the bag is damaged, or opening it was cancelled.
        OSError: the bag cannot be read.
    """
    try:
        return open_bag(path)
    except NotIndexed:
        if is_mcap(path):
            raise
        size = max(path.stat().st_size, 1)
        return BagReader(path, rebuild_index=True, progress=lambda at: progress.note(at / size))


def description_of(reader: BagReader) -> Mapping[str, Any]:
    """Return what the page shows about a bag: its times (s), its size, its damage and its tracks.

    Raises:
        BagError, OSError: the bag cannot be read.
    """
    begin_ns, end_ns = reader.range_ns
    return {
        "begin": begin_ns / NS_PER_S,
        "end": end_ns / NS_PER_S,
        "size": reader.size,
        "bins": BINS,
        "damage": reader.damage[:3],
        "tracks": bounded_list(map(dataclasses.asdict, tracks(reader))),
    }
