"""Export part of a bag for download by a browser: as a bag, or as a ZIP file of tables or images."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from typing import IO, Final

from pipros.basics.file_names import distinct_name
from pipros.basics.limits import limit_text
from pipros.msg.errors import MessageException
from pipros.msg.time import NS_PER_S
from pipros_libraries.pictures.image_message import IMAGE_TYPES
from pipros_page.bags.newest import newest_before
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.images import image_file
from pipros_tools.bag.left_out import LeftOut
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.times import received_at
from pipros_tools.bag.writer import BagWriter
from pipros_tools.graph.message_path import Part
from pipros_tools.graph.message_rows import MessageRows

STATIC_TRANSFORMS: Final = "/tf_static"
FORMATS: Final = ("bag", "csv", "images")
_NOT_IN_ENTRIES: Final = re.compile(r"[^\w~-]")
_LONGEST_NAME: Final = 200  # file systems allow 255 bytes, a number and suffixes included


class _SizeBudget:
    """Limits the size of an export."""

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = self._left_bytes = limit_bytes

    def take(self, size: int) -> None:
        self._left_bytes -= size
        if self._left_bytes < 0:
            budget = limit_text("page_export_bytes", self._limit_bytes)
            raise BagError(f"the selection is too large; {budget}")


def export(
    reader: BagReader,
    topics: Collection[str],
    range_ns: tuple[int, int],
    form: str,
    file: IO[bytes],
    limit_bytes: int,
) -> None:
    """Write the messages on the given topics within a time range, including both ends.

    Args:
        form: one of `FORMATS`. Bags begin with the latched messages published before the range. Tables have
            the rows that `rostopic echo -p` prints, with recorded times. With `images`, topics that are not
            images are skipped. What cannot be written is left out, and listed in `left_out.txt`.
        limit_bytes: maximum total size of the messages; for tables, of the rows.

    Raises:
        BagError: the messages exceed the limit, or the bag is damaged.
    """
    budget = _SizeBudget(limit_bytes)
    if form == "bag":
        _bag(reader, topics, range_ns, file, budget)
        return
    lines: list[str] = []
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        entries = _Entries(reader, range_ns, archive, budget, LeftOut(lines.append))
        for topic in sorted(topics):
            if form == "csv":
                entries.add_table(topic)
            elif any(each.type in IMAGE_TYPES for each in reader.connections_of(topic)):
                entries.add_images(topic)
        if lines:
            archive.writestr("left_out.txt", "".join(f"{line}\n" for line in lines))


def _entry_name(topic: str) -> str:
    """Return the name of a topic's ZIP entry. Dots are replaced, because `..` would lead out of a folder."""
    return _NOT_IN_ENTRIES.sub("_", topic.strip("/").replace("/", "__"))[:_LONGEST_NAME] or "topic"


def _bag(
    reader: BagReader,
    topics: Collection[str],
    range_ns: tuple[int, int],
    file: IO[bytes],
    budget: _SizeBudget,
) -> None:
    writer = BagWriter(file)
    wanted = [each for each in reader.connections if each.topic in topics]
    added = {each.id: writer.add_connection(each.topic, each.header) for each in wanted}
    begin = divmod(range_ns[0], NS_PER_S)
    for message in _latched_before(reader, wanted, range_ns[0]):
        budget.take(len(message.data))
        writer.write(added[message.connection.id], *begin, message.data)
    for message in reader.stored_messages(wanted, *range_ns):
        budget.take(len(message.data))
        writer.write(added[message.connection.id], *divmod(message.time_ns, NS_PER_S), message.data)
    writer.finish()


def _latched_before(
    reader: BagReader, connections: Collection[Connection], begin_ns: int
) -> Iterator[StoredMessage]:
    """Yield the latched messages published before `begin_ns`: all static transforms, and every other
    connection's newest message.
    """
    for connection in connections:
        if connection.header.get("latching") != b"1":
            continue
        if connection.topic == STATIC_TRANSFORMS:
            yield from reader.stored_messages([connection], None, begin_ns - 1)
        elif (newest := newest_before(reader, [connection], begin_ns - 1)) is not None:
            yield newest


@dataclass(frozen=True, slots=True)
class _Entries:
    """Writes topics to the entries of a ZIP archive."""

    reader: BagReader
    range_ns: tuple[int, int]
    archive: zipfile.ZipFile
    budget: _SizeBudget
    left_out: LeftOut
    taken: dict[str, int] = field(default_factory=dict)

    def _name(self, topic: str) -> str:
        return distinct_name(_entry_name(topic), self.taken)

    def add_table(self, topic: str) -> None:
        rows, is_first = MessageRows(), True
        with self.archive.open(f"{self._name(topic)}.csv", "w", force_zip64=True) as table:
            for message in self.reader.stored_messages(self.reader.connections_of(topic), *self.range_ns):
                try:
                    decoded = self.reader.decode(message)
                except (BagError, MessageException) as error:
                    self.left_out.message(topic, f"{received_at(message.time_ns)}: {error}")
                    continue
                part = Part(decoded, message.connection.type)
                if is_first:
                    table.write(rows.heading(part).encode() + b"\n")
                    is_first = False
                row = rows.row(part, message.time_ns).encode() + b"\n"
                self.budget.take(len(row))
                table.write(row)

    def add_images(self, topic: str) -> None:
        name = self._name(topic)
        images = [each for each in self.reader.connections_of(topic) if each.type in IMAGE_TYPES]
        for number, message in enumerate(self.reader.stored_messages(images, *self.range_ns)):
            self.budget.take(len(message.data))
            try:
                suffix, content = image_file(self.reader.decode(message))
            except (BagError, MessageException) as error:
                self.left_out.message(topic, f"{received_at(message.time_ns)}: {error}")
                continue
            seconds, nanoseconds = divmod(message.time_ns, NS_PER_S)
            self.archive.writestr(f"{name}/{number:06d}_{seconds}.{nanoseconds:09d}{suffix}", content)
