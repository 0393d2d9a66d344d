"""`rosbag export`: exports topics from a bag to CSV, NumPy and image files."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Protocol

from pipros.bag.connection import Connection
from pipros.bag.errors import BagError
from pipros.bag.images import check_image, image_array_file, image_file
from pipros.bag.left_out import LeftOut
from pipros.bag.reader import BagReader
from pipros.bag.times import received_at
from pipros.basics.extras import install_command
from pipros.basics.names import canonicalize, is_legal_topic
from pipros.basics.printable import listed
from pipros.cli.rosbag.other_bags import add_reading_options, opened, warned
from pipros.cli.runner import CommandError, option_parser
from pipros.graph.message_path import Part
from pipros.graph.message_rows import MessageRows
from pipros.msg.base import Message
from pipros.msg.errors import MessageException
from pipros.msg.time import Time, TVal
from pipros.pictures.image_message import IMAGE_TYPES

_LONGEST_NAME: Final = 240  # file systems allow 255 bytes, a number and suffixes included
_FORMATS = ("csv", "npz")
_BUFFERED = 1 << 24
"""Maximum number of characters that wait to be written."""


def export(argv: Sequence[str]) -> int:
    parser = option_parser(
        "rosbag",
        "",
        "Export each topic to one table. Images are exported to one file each.",
    )
    parser.usage = "rosbag export [options] BAG DIR [TOPIC1 TOPIC2 ...]"
    parser.add_option(
        "--format",
        dest="format",
        default="csv",
        metavar="FORMAT",
        help="csv (default) or npz, which needs NumPy",
    )
    add_reading_options(parser)
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) < 2:
        parser.error("You must specify a bag file and a folder.")
    if options.format not in _FORMATS:
        parser.error(f"the format must be one of {', '.join(_FORMATS)}, got {options.format}")
    folder, left_out = Path(arguments[1]), warned()
    chosen = arguments[2:]
    with opened(arguments[0], options, left_out, lambda name: not chosen or name in chosen) as bag:
        of_topic = bag.connections_by_topic()
        topics = chosen or sorted(of_topic)
        unknown = set(topics) - of_topic.keys() - bag.skipped.keys()
        if unknown:
            raise CommandError(f"the bag does not contain the topics {', '.join(sorted(unknown))}")
        folder.mkdir(parents=True, exist_ok=True)
        names = _file_names(topics, left_out)
        chosen = [topic for topic in names if topic in of_topic]
        # Tables and images are written in one pass over the bag; the arrays of a topic are held in memory.
        for group in [[topic] for topic in chosen] if options.format == "npz" else [chosen]:
            paths = {topic: folder / names[topic] for topic in group}
            _export(bag, {topic: of_topic[topic] for topic in group}, paths, options.format, left_out)
    return 1 if left_out else 0


def _file_names(topics: Iterable[str], left_out: LeftOut) -> dict[str, str]:
    """Return each topic's output file or folder name, without suffix: `a__b` for `/a/b`.

    A number is appended to a name that would collide with an earlier name, ignoring case. Topics with invalid
    names, which could point outside the output folder, are left out, as are names too long for a file.
    """
    names: dict[str, str] = {}
    taken: dict[str, int] = {}
    for topic in topics:
        if not is_legal_topic(topic):
            left_out.whole(topic, "it is not a legal topic name")
            continue
        base = name = canonicalize(topic).strip("/").replace("/", "__")
        if len(base) > _LONGEST_NAME:
            left_out.whole(topic, "its name is too long for a file")
            continue
        while name.lower() in taken:
            taken[base.lower()] += 1
            name = f"{base}_{taken[base.lower()]}"
        taken[name.lower()] = 1
        names[topic] = name
    return names


def _export(
    bag: BagReader,
    of_topic: Mapping[str, Sequence[Connection]],
    paths: Mapping[str, Path],
    form: str,
    left_out: LeftOut,
) -> None:
    """Write the messages of some topics. What cannot be written is left out, and affects nothing else."""
    sinks: dict[int, _Sink] = {}
    buffer = _Buffer()
    for topic, connections in of_topic.items():
        first = connections[0]
        try:
            bag.class_of(first)
            sink = _sink(first.type, paths[topic], form, buffer, left_out)
        except (BagError, MessageException) as error:
            left_out.whole(topic, error)
            continue
        for each in connections:
            if _kind(each) == _kind(first):
                try:
                    bag.class_of(each)
                    sinks[each.id] = sink
                except (BagError, MessageException) as error:
                    left_out.message(topic, error)
            else:
                wrong, right = (" ".join(_kind(side)) for side in (each, first))
                left_out.message(topic, f"their type is {wrong}, not {right}")
    wanted = [each for connections in of_topic.values() for each in connections if each.id in sinks]
    try:
        for connection, time_ns, message in bag.decoded(wanted):
            sinks[connection.id].add(connection, Time(0, time_ns), message)
    finally:
        buffer.flush()
        for sink in set(sinks.values()):
            sink.finish()
    for topic, connections in of_topic.items():
        if connections[0].id in sinks:
            done = sinks[connections[0].id]
            print(f"{topic}: {done.count} messages to {done.path}")


def _kind(connection: Connection) -> tuple[str, str]:
    return connection.type, connection.md5sum


def _sink(type_name: str, path: Path, form: str, buffer: _Buffer, left_out: LeftOut) -> _Sink:
    if type_name in IMAGE_TYPES:
        return _ImageArrays(path, left_out) if form == "npz" else _ImageFiles(path, left_out)
    return _Arrays(path) if form == "npz" else _Table(path, buffer)


class _Sink(Protocol):
    """The output of one topic."""

    path: Path
    count: int

    def add(self, connection: Connection, time: Time, message: Any) -> None: ...
    def finish(self) -> None: ...


class _Buffer:
    """Lines for many files, of which few can be open at a time."""

    def __init__(self) -> None:
        self._lines: dict[Path, list[str]] = {}
        self._size = 0

    def add(self, path: Path, line: str) -> None:
        self._lines.setdefault(path, []).append(line)
        self._size += len(line)
        if self._size > _BUFFERED:
            self.flush()

    def flush(self) -> None:
        for path, lines in self._lines.items():
            with path.open("a", encoding="utf-8", newline="") as file:
                file.writelines(lines)
        self._lines, self._size = {}, 0


class _Table:
    """The rows that `rostopic echo -p` prints, with the times from the bag."""

    def __init__(self, path: Path, buffer: _Buffer) -> None:
        self.path = path.with_name(path.name + ".csv")
        self.path.write_bytes(b"")
        self.count = 0
        self._buffer = buffer
        self._rows = MessageRows()

    def add(self, connection: Connection, time: Time, message: Any) -> None:
        part = Part(message, connection.type)
        if not self.count:
            self._buffer.add(self.path, self._rows.heading(part) + "\n")
        self._buffer.add(self.path, self._rows.row(part, time.to_nsec()) + "\n")
        self.count += 1

    def finish(self) -> None: ...


class _Images:
    """Images by name, which is their time. Damaged images are left out."""

    def __init__(self, path: Path, left_out: LeftOut) -> None:
        self.path = path
        self.count = self._same = 0
        self._left_out = left_out
        self._previous: Time | None = None

    def add(self, connection: Connection, time: Time, message: Any) -> None:
        self._same = self._same + 1 if time == self._previous else 1
        self._previous = time
        name = f"{time.secs}.{time.nsecs:09d}" + (f"_{self._same}" if self._same > 1 else "")
        try:
            check_image(message)
            self._write(name, message)
        except BagError as error:
            self._left_out.message(connection.topic, f"{received_at(time.to_nsec())}: {error}")
        else:
            self.count += 1

    def _write(self, name: str, message: Any) -> None:
        raise NotImplementedError

    def finish(self) -> None: ...


class _ImageFiles(_Images):
    """A folder with a file for each image."""

    def __init__(self, path: Path, left_out: LeftOut) -> None:
        super().__init__(path, left_out)
        path.mkdir(exist_ok=True)

    def _write(self, name: str, message: Any) -> None:
        suffix, content = image_file(message)
        (self.path / (name + suffix)).write_bytes(content)


class _ImageArrays(_Images):
    """An array for each image, in one file."""

    def __init__(self, path: Path, left_out: LeftOut) -> None:
        super().__init__(path.with_name(path.name + ".npz"), left_out)
        self._file = zipfile.ZipFile(self.path, "w", zipfile.ZIP_DEFLATED)

    def _write(self, name: str, message: Any) -> None:
        self._file.writestr(f"{name}.npy", image_array_file(message))

    def finish(self) -> None:
        self._file.close()


class _Arrays:
    """One array per field, and an array `time` of the message times.

    Times are in ns. Strings, lists of varying length, and lists of strings, times or messages are omitted.
    """

    def __init__(self, path: Path) -> None:
        try:
            import numpy
        except ImportError:
            raise CommandError(
                f"npz files need numpy, which is not installed. Try: {install_command('numpy')}"
            ) from None
        self.path = path.with_name(path.name + ".npz")
        self.count = 0
        self._numpy = numpy
        self._topic = ""
        self._columns: dict[str, list[Any]] = {"time": []}

    def add(self, connection: Connection, time: Time, message: Any) -> None:
        self._topic = connection.topic
        self._columns["time"].append(time.to_nsec())
        _flatten("", message, self._columns)
        self.count += 1

    def finish(self) -> None:
        kept: dict[str, Any] = {}
        for name, values in self._columns.items():
            sizes = {len(value) if isinstance(value, list | tuple | bytes) else -1 for value in values}
            if len(values) != self.count or len(sizes) > 1:
                print(f"{self._topic}: {listed(name)} is omitted, because its length varies", file=sys.stderr)
                continue
            lists = [list(value) if isinstance(value, bytes) else value for value in values]
            kept[name] = self._numpy.array(lists)
        self._numpy.savez_compressed(self.path, **kept)


def _flatten(name: str, value: Any, columns: dict[str, list[Any]]) -> None:
    if isinstance(value, Message):
        for field in value.__slots__:
            _flatten(f"{name}.{field}" if name else field, getattr(value, field), columns)
    elif isinstance(value, TVal):
        columns.setdefault(name, []).append(value.to_nsec())
    elif isinstance(value, bool | int | float | bytes) or (
        isinstance(value, list | tuple) and not any(isinstance(each, Message | TVal | str) for each in value)
    ):
        columns.setdefault(name, []).append(value)
