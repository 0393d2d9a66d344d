"""`rosbag export`: exports topics from a bag to CSV, NumPy and image files."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TextIO

from pipros.bag.connection import Connection
from pipros.bag.errors import BagError
from pipros.bag.images import image_file
from pipros.bag.reader import BagReader
from pipros.basics.extras import install_command
from pipros.basics.names import canonicalize, is_legal_topic
from pipros.basics.printable import listed
from pipros.cli.rosbag.other_bags import add_reading_options, opened
from pipros.cli.runner import CommandError, option_parser
from pipros.graph.message_path import Part
from pipros.graph.message_rows import MessageRows
from pipros.msg.base import Message
from pipros.msg.time import TVal
from pipros.pictures.image_message import IMAGE_TYPES

_FORMATS = ("csv", "npz")


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
    folder = Path(arguments[1])
    with opened(arguments[0], options) as bag:
        topics = arguments[2:] or sorted({connection.topic for connection in bag.connections})
        unknown = set(topics) - {connection.topic for connection in bag.connections}
        if unknown:
            raise CommandError(f"the bag does not contain the topics {', '.join(sorted(unknown))}")
        files = _file_names(topics)
        folder.mkdir(parents=True, exist_ok=True)
        for topic, name in files.items():
            _export(bag, topic, folder / name, options.format)
    return 0


def _file_names(topics: Iterable[str]) -> dict[str, str]:
    """Return each topic's output file or folder name, without suffix: `a__b` for `/a/b`.

    A number is appended to a name that would collide with an earlier name, ignoring case.

    Raises:
        CommandError: a topic name is invalid and could point outside the output folder.
    """
    names: dict[str, str] = {}
    taken: set[str] = set()
    for topic in topics:
        if not is_legal_topic(topic):
            raise CommandError(
                f"[{listed(topic)}] is not a legal topic name. To export other topics, list them after the "
                "folder"
            )
        base = name = canonicalize(topic).strip("/").replace("/", "__")
        number = 1
        while name.lower() in taken:
            number += 1
            name = f"{base}_{number}"
        taken.add(name.lower())
        names[topic] = name
    return names


def _export(bag: BagReader, topic: str, path: Path, form: str) -> None:
    connections: list[Connection] = bag.connections_of(topic)
    if connections[0].type in IMAGE_TYPES:
        written = _images(bag, topic, path)
    elif form == "npz":
        path = path.with_name(path.name + ".npz")
        written = _arrays(bag, topic, path)
    else:
        path = path.with_name(path.name + ".csv")
        with path.open("w", encoding="utf-8", newline="") as file:
            written = _table(bag, topic, file)
    print(f"{topic}: {written} messages to {path}")


def _table(bag: BagReader, topic: str, file: TextIO) -> int:
    """Write the rows that `rostopic echo -p` prints, with the times from the bag.

    Return the number of messages.
    """
    rows, count = MessageRows(), 0
    for _, message, time, connection in bag.messages(topic):
        part = Part(message, connection.type)
        if not count:
            file.write(rows.heading(part) + "\n")
        file.write(rows.row(part, time.to_nsec()) + "\n")
        count += 1
    return count


def _images(bag: BagReader, topic: str, folder: Path) -> int:
    folder.mkdir(exist_ok=True)
    count = same = 0
    previous = None
    for _, message, time, _ in bag.messages(topic):
        try:
            suffix, content = image_file(message)
        except BagError as error:
            raise CommandError(f"{topic}: {error}") from error
        same = same + 1 if time == previous else 1
        name = f"{time.secs}.{time.nsecs:09d}" + (f"_{same}" if same > 1 else "")
        (folder / (name + suffix)).write_bytes(content)
        count, previous = count + 1, time
    return count


def _arrays(bag: BagReader, topic: str, path: Path) -> int:
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
    for _, message, time, _ in bag.messages(topic):
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
