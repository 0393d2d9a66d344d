"""Read bags in format 1.2, which ROS wrote until 2010 (http://wiki.ros.org/Bags/Format/1.2).

Such bags do not have chunks. They are sequences of definitions and messages, and each message is stored with
its topic, type and md5sum. They are scanned once and presented as chunks, so that readers do not need to
distinguish the formats.
"""

from __future__ import annotations

from pipros.msg.time import NS_PER_S
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.index import ChunkHeader
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.records import Fields, Op, Version, checked_time, number, op_of, text_of
from pipros_tools.bag.scan import Contents, add_chunk
from pipros_tools.bag.source import Source

_PART_BYTES = 1024 * 1024
"""Approximate size of the messages that form one chunk."""


def scan_old_format(source: Source, version: Version, start: int) -> BagLayout:
    """Return the connections and messages in a format 1.2 bag whose first record starts at `start`.

    A truncated or damaged file is read up to the damage, which `BagLayout.damage` describes.
    """
    layout = BagLayout(version, index_position=1)
    definitions: dict[tuple[str, str], bytes] = {}
    known: dict[tuple[str, str, str], int] = {}
    part, part_start = Contents(), start
    position = start
    while position < source.size:
        try:
            fields, data_position, data_size = source.header(position)
            where = source.at(position)
            op = op_of(fields, where)
            after = data_position + data_size
            if after > source.size:
                raise BagFormatError(f"{where}: the file ends within this record")
            if op == Op.MESSAGE_DEFINITION:
                definitions[_text(fields, "type", where), _text(fields, "md5", where)] = fields.get(
                    "def", b""
                )
            elif op == Op.MESSAGE:
                time_ns = number(fields, "sec", 4, where) * NS_PER_S + number(fields, "nsec", 4, where)
                connection = _connection(layout, fields, known, definitions, where)
                part.add(connection, checked_time(time_ns, where), position - part_start)
        except BagFormatError as error:
            layout.damage.append(str(error))
            break
        position = after
        if position - part_start > _PART_BYTES:
            _end_part(layout, part, part_start, position)
            part, part_start = Contents(), position
    _end_part(layout, part, part_start, position)
    layout.end = position
    return layout


def _end_part(layout: BagLayout, part: Contents, start: int, end: int) -> None:
    add_chunk(layout, start, ChunkHeader("none", start, end - start, end - start), part)


def _text(fields: Fields, name: str, where: str) -> str:
    if name not in fields:
        raise BagFormatError(f"{where}: the field [{name}] is missing")
    return text_of(fields[name])


def _connection(
    layout: BagLayout,
    fields: Fields,
    known: dict[tuple[str, str, str], int],
    definitions: dict[tuple[str, str], bytes],
    where: str,
) -> int:
    key = topic, type_name, md5sum = tuple(_text(fields, name, where) for name in ("topic", "type", "md5"))
    if key not in known:
        identity = known[topic, type_name, md5sum] = len(known)
        header = {
            "topic": topic.encode(),
            "type": type_name.encode(),
            "md5sum": md5sum.encode(),
            "message_definition": definitions.get((type_name, md5sum), b""),
        }
        layout.connections[identity] = Connection(identity, topic, header)
    return known[topic, type_name, md5sum]
