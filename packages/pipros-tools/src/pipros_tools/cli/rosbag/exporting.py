"""`rosbag export`: exports topics from a bag to CSV, NumPy and image files."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

from pipros.basics.extras import required
from pipros.basics.file_names import distinct_name, file_stem
from pipros.basics.log_file import open_to_write
from pipros.basics.names import canonicalize, is_legal_topic
from pipros.basics.replaced_file import cleared, naming, replaced_file, write_whole
from pipros.basics.windows import replace_file
from pipros.msg.errors import MessageException
from pipros.msg.time import Time
from pipros_libraries.pictures.image_message import IMAGE_TYPES
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.images import check_image, image_array_file, image_file
from pipros_tools.bag.left_out import LeftOut
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.times import received_at
from pipros_tools.cli.rosbag.other_bags import add_reading_options, name_beside, opened, warned
from pipros_tools.cli.runner import CommandError, option_parser
from pipros_tools.graph.message_path import Part
from pipros_tools.graph.message_rows import MessageRows

_LONGEST_NAME: Final = 240  # file systems allow 255 bytes, a number and suffixes included
_FORMATS = ("csv", "npz")
_BUFFERED = 1 << 24
"""Maximum number of characters that wait to be written to files, of which few can be open at a time."""


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
        name_beside([bag])
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
        base = file_stem(canonicalize(topic).strip("/").replace("/", "__"))
        if len(base) > _LONGEST_NAME:
            left_out.whole(topic, "its name is too long for a file")
            continue
        names[topic] = distinct_name(base, taken)
    return names


def _export(
    bag: BagReader,
    of_topic: Mapping[str, Sequence[Connection]],
    paths: Mapping[str, Path],
    form: str,
    left_out: LeftOut,
) -> None:
    """Write the messages of some topics. What cannot be written is left out, and affects nothing else."""
    sinks = _sinks(bag, of_topic, paths, form, left_out)
    failed: set[_Sink] = set()

    def attempt(sink: _Sink, action: Callable[[], int | None]) -> int:
        """Carry out an action of a sink, unless it failed before. On failure, the old file stays."""
        try:
            return 0 if sink in failed else action() or 0
        except OSError as error:
            failed.add(sink)
            sink.discard()
            left_out.whole(sink.topic, error)
            return 0

    wanted = [each for connections in of_topic.values() for each in connections if each.id in sinks]
    used, waiting = list(dict.fromkeys(sinks.values())), 0
    try:
        for connection, time_ns, message in bag.decoded(wanted):
            sink = sinks[connection.id]
            waiting += attempt(sink, partial(sink.add, Time(0, time_ns), message))
            if waiting > _BUFFERED:
                waiting = 0
                for sink in used:
                    attempt(sink, sink.flush)
    finally:
        for sink in used:
            attempt(sink, sink.finish)
    for sink in used:
        if sink not in failed:
            print(f"{sink.topic}: {sink.count} messages to {sink.path}")


def _sinks(
    bag: BagReader,
    of_topic: Mapping[str, Sequence[Connection]],
    paths: Mapping[str, Path],
    form: str,
    left_out: LeftOut,
) -> dict[int, _Sink]:
    """Return the sink of each connection: one per topic, with the type of the topic's first connection."""
    sinks: dict[int, _Sink] = {}
    for topic, connections in of_topic.items():
        first = connections[0]
        try:
            sink = _sink(first, bag.class_of(first)._full_text, paths[topic], form, left_out)
        except (BagError, MessageException, OSError) as error:
            left_out.whole(topic, error)
            continue
        for each in connections:
            if _kind(each) != _kind(first):
                wrong, right = (" ".join(_kind(side)) for side in (each, first))
                left_out.message(topic, f"their type is {wrong}, not {right}")
                continue
            try:
                bag.class_of(each)
                sinks[each.id] = sink
            except (BagError, MessageException) as error:
                left_out.message(topic, error)
    return sinks


def _kind(connection: Connection) -> tuple[str, str]:
    return connection.type, connection.md5sum


def _sink(first: Connection, full_text: str, path: Path, form: str, left_out: LeftOut) -> _Sink:
    if first.type in IMAGE_TYPES:
        kind = _ImageArrays if form == "npz" else _ImageFiles
        return kind(first.topic, path, left_out)
    return _Arrays(first, path, full_text) if form == "npz" else _Table(first, path)


class _Sink:
    """The output of one topic.

    A file gets its name when it is complete, so that a full disk costs no earlier file.
    """

    def __init__(self, topic: str, path: Path) -> None:
        self.topic = topic
        self.path = path
        self.count = 0

    def add(self, time: Time, message: Any) -> int | None:
        """Add a message. Return the number of its pending characters, if any."""
        raise NotImplementedError

    def flush(self) -> None:
        """Write the pending lines."""

    def finish(self) -> None:
        """Complete the file."""

    def discard(self) -> None:
        """Remove the unfinished file."""


class _Table(_Sink):
    """The rows that `rostopic echo -p` prints, with the times from the bag."""

    def __init__(self, first: Connection, path: Path) -> None:
        super().__init__(first.topic, path.with_name(path.name + ".csv"))
        self._type = first.type
        self._rows = MessageRows()
        self._lines: list[str] = []
        self._unfinished = path.with_name(path.name + ".csv.active")
        cleared(self._unfinished).touch(exist_ok=False)

    def add(self, time: Time, message: Any) -> int:
        part = Part(message, self._type)
        if not self.count:
            self._lines.append(self._rows.heading(part) + "\n")
        self._lines.append(self._rows.row(part, time.to_nsec()) + "\n")
        self.count += 1
        return len(self._lines[-1])

    def flush(self) -> None:
        with (
            naming(self.path),
            open(open_to_write(self._unfinished), "w", encoding="utf-8", newline="") as file,
        ):
            file.writelines(self._lines)
        self._lines = []

    def finish(self) -> None:
        self.flush()
        replace_file(self._unfinished, self.path)

    def discard(self) -> None:
        self._lines = []
        self._unfinished.unlink(missing_ok=True)


class _Images(_Sink):
    """Images by name, which is their time. Damaged images are left out."""

    def __init__(self, topic: str, path: Path, left_out: LeftOut) -> None:
        super().__init__(topic, path)
        self._same = 0
        self._left_out = left_out
        self._previous: Time | None = None

    def add(self, time: Time, message: Any) -> None:
        self._same = self._same + 1 if time == self._previous else 1
        self._previous = time
        name = f"{time.secs}.{time.nsecs:09d}" + (f"_{self._same}" if self._same > 1 else "")
        try:
            check_image(message)
            self._write(name, message)
        except BagError as error:
            self._left_out.message(self.topic, f"{received_at(time.to_nsec())}: {error}")
        else:
            self.count += 1

    def _write(self, name: str, message: Any) -> None:
        raise NotImplementedError


class _ImageFiles(_Images):
    """A folder with a file for each image."""

    def __init__(self, topic: str, path: Path, left_out: LeftOut) -> None:
        super().__init__(topic, path, left_out)
        path.mkdir(exist_ok=True)

    def _write(self, name: str, message: Any) -> None:
        suffix, content = image_file(message)
        write_whole(self.path / (name + suffix), content)


class _ImageArrays(_Images):
    """An array for each image, in one file."""

    def __init__(self, topic: str, path: Path, left_out: LeftOut) -> None:
        super().__init__(topic, path.with_name(path.name + ".npz"), left_out)
        self._stack = ExitStack()
        file = self._stack.enter_context(replaced_file(self.path, is_synced=False))
        self._file = self._stack.enter_context(zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED))

    def _write(self, name: str, message: Any) -> None:
        with naming(self.path):
            self._file.writestr(f"{name}.npy", image_array_file(message))

    def finish(self) -> None:
        self._stack.close()

    def discard(self) -> None:
        with suppress(OSError), self._stack:
            raise OSError


class _Arrays(_Sink):
    """One array per field, and an array `time` of the message times; see `field_arrays`.

    If a field has this name, the times are in the array `_time`.
    """

    def __init__(self, first: Connection, path: Path, full_text: str) -> None:
        super().__init__(first.topic, path.with_name(path.name + ".npz"))
        self._numpy = required("numpy", "npz files need numpy", "numpy")
        self._kind = first.type, full_text
        self._times: list[int] = []
        self._ends: list[int] = []
        self._data = io.BytesIO()

    def add(self, time: Time, message: Any) -> None:
        message.serialize(self._data)
        self._times.append(time.to_nsec())
        self._ends.append(self._data.tell())
        self.count += 1

    def finish(self) -> None:
        from pipros.msg.bulk.arrays import field_arrays

        found = field_arrays(*self._kind, self._data.getbuffer(), self._ends)
        content = io.BytesIO()
        found["_time" if "time" in found else "time"] = self._numpy.array(self._times, "int64")
        # `savez_compressed` takes arrays as keywords, and fields may be named like its parameters
        arrays: Any = self._numpy.lib.format
        with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, array in found.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                    arrays.write_array(file, self._numpy.asanyarray(array))
        write_whole(self.path, content.getvalue())
