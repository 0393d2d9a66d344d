"""`rosbag export`: exports topics from a bag to CSV, NumPy and image files."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pipros.bag.connection import Connection
from pipros.bag.errors import BagError
from pipros.bag.images import check_image, image_array_file, image_file
from pipros.bag.left_out import LeftOut
from pipros.bag.reader import BagMessage, BagReader, received_at
from pipros.basics.extras import install_command
from pipros.basics.names import canonicalize, is_legal_topic
from pipros.basics.printable import listed
from pipros.cli.rosbag.other_bags import add_reading_options, opened, warned
from pipros.cli.runner import CommandError, option_parser
from pipros.graph.message_path import Part
from pipros.graph.message_rows import MessageRows
from pipros.msg.base import Message
from pipros.msg.errors import MessageException
from pipros.msg.time import TVal
from pipros.pictures.image_message import IMAGE_TYPES

_FORMATS = ("csv", "npz")

Messages = Iterable[BagMessage]


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
        for topic, name in _file_names(topics, left_out).items():
            if topic in of_topic:
                _export(bag, of_topic[topic], folder / name, options.format, left_out)
    return 1 if left_out else 0


def _file_names(topics: Iterable[str], left_out: LeftOut) -> dict[str, str]:
    """Return each topic's output file or folder name, without suffix: `a__b` for `/a/b`.

    A number is appended to a name that would collide with an earlier name, ignoring case. Topics with invalid
    names, which could point outside the output folder, are left out.
    """
    names: dict[str, str] = {}
    taken: dict[str, int] = {}
    for topic in topics:
        if not is_legal_topic(topic):
            left_out.whole(topic, "it is not a legal topic name")
            continue
        base = name = canonicalize(topic).strip("/").replace("/", "__")
        while name.lower() in taken:
            taken[base.lower()] += 1
            name = f"{base}_{taken[base.lower()]}"
        taken[name.lower()] = 1
        names[topic] = name
    return names


def _export(
    bag: BagReader, connections: Sequence[Connection], path: Path, form: str, left_out: LeftOut
) -> None:
    """Write the messages of a topic. What cannot be written is left out, and does not affect other topics."""
    first = connections[0]
    for other in connections:
        if _kind(other) != _kind(first):
            wrong, right = (" ".join(_kind(each)) for each in (other, first))
            left_out.message(other.topic, f"their type is {wrong}, not {right}")
    messages = bag.messages(first.topic, where=lambda each: _kind(each) == _kind(first))
    is_image = first.type in IMAGE_TYPES
    write: Callable[[Messages, Path, LeftOut], int] = _image_files if is_image else _table
    if form == "npz":
        write = _image_arrays if is_image else _arrays
        path = path.with_name(path.name + ".npz")
    elif not is_image:
        path = path.with_name(path.name + ".csv")
    try:
        written = write(messages, path, left_out)
    except (BagError, MessageException) as error:
        if not path.is_dir():
            path.unlink(missing_ok=True)
        left_out.whole(first.topic, error)
        return
    print(f"{first.topic}: {written} messages to {path}")


def _kind(connection: Connection) -> tuple[str, str]:
    return connection.type, connection.md5sum


def _table(messages: Messages, path: Path, _: LeftOut) -> int:
    """Write the rows that `rostopic echo -p` prints, with the times from the bag.

    Return the number of messages.
    """
    rows, count = MessageRows(), 0
    with path.open("w", encoding="utf-8", newline="") as file:
        for _topic, message, time, connection in messages:
            part = Part(message, connection.type)
            if not count:
                file.write(rows.heading(part) + "\n")
            file.write(rows.row(part, time.to_nsec()) + "\n")
            count += 1
    return count


def _image_files(messages: Messages, folder: Path, left_out: LeftOut) -> int:
    folder.mkdir(exist_ok=True)
    count = 0
    for name, content in _images(messages, image_file, left_out):
        (folder / (name + content[0])).write_bytes(content[1])
        count += 1
    return count


def _image_arrays(messages: Messages, path: Path, left_out: LeftOut) -> int:
    """Write an array for each image, named after its time."""
    count = 0
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in _images(messages, image_array_file, left_out):
            file.writestr(f"{name}.npy", content)
            count += 1
    return count


_Content = TypeVar("_Content")


def _images(
    messages: Messages, convert: Callable[[Any], _Content], left_out: LeftOut
) -> Iterator[tuple[str, _Content]]:
    """Yield the name and the content of each image. Damaged images are left out."""
    same = 0
    previous = None
    for topic, message, time, _ in messages:
        same = same + 1 if time == previous else 1
        previous = time
        try:
            check_image(message)
            content = convert(message)
        except BagError as error:
            left_out.message(topic, f"{received_at(time.to_nsec())}: {error}")
            continue
        yield f"{time.secs}.{time.nsecs:09d}" + (f"_{same}" if same > 1 else ""), content


def _arrays(messages: Messages, path: Path, _: LeftOut) -> int:
    """Write one array per field, and an array `time` of the message times. Return the number of messages.

    Times are in ns. Strings, lists of varying length, and lists of strings, times or messages are omitted.
    """
    try:
        import numpy
    except ImportError:
        raise CommandError(
            f"npz files need numpy, which is not installed. Try: {install_command('numpy')}"
        ) from None
    columns: dict[str, list[Any]] = {"time": []}
    topic = ""
    for topic, message, time, _connection in messages:  # noqa: B007 # used below
        columns["time"].append(time.to_nsec())
        _flatten("", message, columns)
    count = len(columns["time"])
    kept: dict[str, Any] = {}
    for name, values in columns.items():
        sizes = {len(value) if isinstance(value, list | tuple | bytes) else -1 for value in values}
        if len(values) != count or len(sizes) > 1:
            print(f"{topic}: {listed(name)} is omitted, because its length varies", file=sys.stderr)
            continue
        kept[name] = numpy.array([list(value) if isinstance(value, bytes) else value for value in values])
    numpy.savez_compressed(path, **kept)
    return count


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
