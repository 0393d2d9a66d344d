"""Bag formats that a plugin adds to `rosbag`, such as ROS 2 bags."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol

from pipros.basics.plugins import offered
from pipros_tools.bag.left_out import LeftOut
from pipros_tools.bag.opening import is_ros1_bag, open_bag
from pipros_tools.bag.sinks import mcap_sink

if TYPE_CHECKING:
    from pipros_tools.bag.reader import BagReader
    from pipros_tools.bag.sinks import MessageSink


class OtherBags(Protocol):
    """The interface that a plugin offers under the name `bags`. `options` are parsed options."""

    def add_reading_options(self, parser: OptionParser) -> None:
        """Add the options for reading bags in this format."""

    def opened(self, path: str | os.PathLike[str], options: Any) -> BagReader:
        """Open a bag."""
        ...

    def add_writing_options(self, parser: OptionParser) -> None:
        """Add the options of `rosbag convert` for writing bags in this format."""

    def is_chosen(self, parser: OptionParser, options: Any) -> bool:
        """Return whether the options request a bag in this format. Exit with an error if they are invalid."""
        ...

    def recover(self, path: Path, file: BinaryIO) -> list[str]:
        """Copy the readable records of a database to a new file. Return descriptions of the damage."""
        ...

    def target_name(self, source: Path) -> str:
        """Return the file name of the output for an input bag, for use with `--output-dir`."""
        ...

    def written(self, target: Path, options: Any, left_out: LeftOut) -> AbstractContextManager[MessageSink]:
        """Return a context manager that creates a bag. The bag is complete after the block.

        Topics and messages that the format cannot store are reported to `left_out`.
        """
        ...


def other_bags() -> OtherBags | None:
    """Return the interface that an installed plugin offers, or None if no plugin does."""
    found: OtherBags | None = offered("bags")
    return found


def add_reading_options(parser: OptionParser) -> None:
    """Add the options for reading bags in other formats."""
    others = other_bags()
    if others is not None:
        others.add_reading_options(parser)


@contextmanager
def keep_beside(bag: BagReader, writer: Any) -> Iterator[None]:
    """Copy what a file has beside messages, while the block copies these.

    Afterwards, name in one line what the new file cannot store.
    """
    kept = bag.copy_beside(writer)
    yield
    origins = () if mcap_sink(writer) else bag.origins
    _name(bag, kept, (*origins, *getattr(writer, "lost", ())), "the new file cannot store them")


def name_beside(bags: Iterable[BagReader]) -> None:
    """Name in one line for each bag what a command that reads messages has left out."""
    for bag in bags:
        _name(bag, set(), bag.origins, "only the content of messages is read")


def _name(bag: BagReader, kept: set[str], more: Iterable[str], why: str) -> None:
    found = [f"{count} {name}" for name, count in bag.beside().items() if name not in kept]
    if left_out := [*found, *more]:
        print(f"WARNING: {bag.name}: {' and '.join(left_out)} are left out; {why}", file=sys.stderr)


def warned() -> LeftOut:
    """Return a collector that prints warnings."""
    return LeftOut(lambda text: print(f"WARNING: {text}", file=sys.stderr))


def opened(
    path: str | os.PathLike[str],
    options: Any,
    left_out: LeftOut,
    is_requested: Callable[[str], bool] = lambda _: True,
) -> BagReader:
    """Open a bag in any supported format.

    The topics and files of the bag that cannot be read, and later its damaged messages, are reported to
    `left_out` with the bag. `is_requested` returns whether a topic is requested; the default is that all are.

    Raises:
        BagError, OSError: the bag cannot be read.
    """
    others = None if is_ros1_bag(path) else other_bags()
    bag = open_bag(path) if others is None else others.opened(path, options)
    file = os.fspath(path)
    for name, reason in bag.skipped_files.items():
        left_out.whole(name, reason, bag=file)
    for name, reason in bag.skipped.items():
        left_out.whole(name, reason, bag=file, is_requested=is_requested(name))
    bag.on_bad_message = partial(left_out.message, bag=file)
    return bag
