"""Small bags for tests, made without a node."""

import io
from collections.abc import Iterable
from typing import Any

from std_msgs.msg import Int32, String

from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.connection import Connection

Row = tuple[str, Any, int, int]
"""Topic, message, seconds, nanoseconds."""


def header_of(message: Any, topic: str, **more: str) -> dict[str, bytes]:
    """Return the connection header of a publisher of such messages."""
    cls = type(message)
    fields = {"topic": topic, "type": cls._type, "md5sum": cls._md5sum, "message_definition": cls._full_text}
    return {name: value.encode() for name, value in {**fields, **more}.items()}


def bag_bytes(rows: Iterable[Row], *, is_finished: bool = True, **options: Any) -> bytes:
    """Return the contents of a bag with these messages and one connection for each topic.

    Args:
        is_finished: whether to write the index. Without it, the bag is like that of a killed recorder.
        options: arguments of `BagWriter`.
    """
    file = io.BytesIO()
    writer = BagWriter(file, **options)
    connections: dict[str, Connection] = {}
    for topic, message, seconds, nanoseconds in rows:
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, header_of(message, topic))
        writer.write_message(connections[topic], seconds, nanoseconds, message)
    if is_finished:
        writer.finish()
    else:
        writer.flush()
    return file.getvalue()


def some_rows(count: int = 30) -> list[Row]:
    """Return messages on two topics, sorted by time."""
    return [
        (f"/{'ab'[n % 2]}", String(f"text {n}") if n % 2 else Int32(n), 10 + n // 10, n % 10 * 1000)
        for n in range(count)
    ]


def rows_of(reader: BagReader, **options: Any) -> list[tuple[str, Any, int, int]]:
    """Return the messages of a reader as `Row`s, with the value instead of the message."""
    return [
        (topic, message.data, time.secs, time.nsecs) for topic, message, time, _ in reader.messages(**options)
    ]


def values(rows: Iterable[Row]) -> list[tuple[str, Any, int, int]]:
    """Return the rows in the form that `rows_of` returns."""
    return [(topic, message.data, seconds, nanoseconds) for topic, message, seconds, nanoseconds in rows]


def old_bag_bytes(rows: Iterable[Row], *, is_indexed: bool = True) -> bytes:
    """Return the contents of a bag in format 1.2, which ROS wrote until 2010."""
    from pipros_tools.bag.records import TIME, U32, U64, record_bytes

    out = [b"#ROSBAG V1.2\n", b""]
    position = len(out[0]) + len(record_bytes({"op": b"\x03", "index_pos": bytes(8)}, b""))
    index: dict[str, list[bytes]] = {}
    told: set[str] = set()
    for topic, message, seconds, nanoseconds in rows:
        names = {"topic": topic.encode(), "md5": message._md5sum.encode(), "type": message._type.encode()}
        at = position + sum(map(len, out[2:]))  # where the index points: to the definition, if there is one
        if topic not in told:
            told.add(topic)
            out.append(record_bytes({"op": b"\x01", **names, "def": message._full_text.encode()}, b""))
        times = {"sec": U32.pack(seconds), "nsec": U32.pack(nanoseconds)}
        data = io.BytesIO()
        message.serialize(data)
        index.setdefault(topic, []).append(TIME.pack(seconds, nanoseconds) + U64.pack(at))
        out.append(record_bytes({"op": b"\x02", **names, **times}, data.getvalue()))
    end = position + sum(map(len, out[2:]))
    out[1] = record_bytes({"op": b"\x03", "index_pos": U64.pack(end if is_indexed else 0)}, b"")
    if is_indexed:
        for topic, entries in index.items():
            fields = {"op": b"\x04", "topic": topic.encode(), "ver": U32.pack(0)}
            out.append(record_bytes({**fields, "count": U32.pack(len(entries))}, b"".join(entries)))
    return b"".join(out)
