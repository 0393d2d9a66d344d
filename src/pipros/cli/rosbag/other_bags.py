"""Bags of other formats than ROS 1's, which a room can read and write for `rosbag`."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from pipros.bag.opening import is_ros1_bag, open_bag
from pipros.basics.rooms import offered

if TYPE_CHECKING:
    from pipros.bag.reader import BagReader
    from pipros.bag.writer import MessageSink


class OtherBags(Protocol):
    """What a room offers under the name `bags`. `options` are the parsed options of the command."""

    def add_reading_options(self, parser: OptionParser) -> None:
        """Add the options of all commands that read bags."""

    def opened(self, path: str | os.PathLike[str], options: Any) -> BagReader:
        """Open a bag, and print a warning for each topic that is left out."""
        ...

    def add_writing_options(self, parser: OptionParser) -> None:
        """Add the options of `rosbag convert`."""

    def is_chosen(self, parser: OptionParser, options: Any) -> bool:
        """Return whether the options ask for a bag of this format; report those that do not fit together."""
        ...

    def target_name(self, source: Path) -> str:
        """Return the name of the output for an input, in the folder given with `--output-dir`."""
        ...

    def written(self, target: Path, options: Any) -> AbstractContextManager[MessageSink]:
        """Create a bag, which is complete after the block."""
        ...


def other_bags() -> OtherBags | None:
    """Return what an installed room offers, or None."""
    found: OtherBags | None = offered("bags")
    return found


def add_reading_options(parser: OptionParser) -> None:
    """Add the options with which bags of other formats are read."""
    others = other_bags()
    if others is not None:
        others.add_reading_options(parser)


def opened(path: str | os.PathLike[str], options: Any) -> BagReader:
    """Open a bag of any format that is installed.

    Raises:
        BagError, OSError: the bag cannot be read.
    """
    others = None if is_ros1_bag(path) else other_bags()
    return open_bag(path) if others is None else others.opened(path, options)
