"""Any bytes are rows of a table, or raise MalformedMessage; whatever rospy reads is a row.

An input names its type in the first line: `sensor_msgs/Image`, a newline, the bytes.

python -m tests.fuzz.tables --seconds 60
"""

import functools
import sys

import numpy as np

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.bulk.decode import MalformedMessage, decode
from pipros.msg.bulk.plans import MessagePlan, plan_of
from pipros.msg.errors import DeserializationError
from tests.fuzz import mutation
from tests.support.memory import memory_of

MEMORY_PER_BYTE = 200
"""An empty string in an array takes four bytes in a message, and several numbers of 8 bytes in a table."""

MEMORY_OF_PLANS = 4_000_000


def target(data: bytes) -> None:
    name, _, body = data.partition(b"\n")
    try:
        cls = load_message_class(name.decode("ascii", "replace"))
    except PiprosError:
        return
    try:
        cls._from_bytes(body)
        is_readable = True
    except DeserializationError:
        is_readable = False
    plan = plan_of_type(cls._type, cls._full_text)
    # the same message twice is at equal distances; with a part of it between, it is not
    for rows in ([body], [body, body], [body, body[: len(body) // 2], body]):
        is_whole = all(row == body for row in rows)
        is_decoded = decodes(plan, rows)
        assert not (is_readable and is_whole and not is_decoded), f"{cls._type}: rospy reads it"


@functools.cache
def plan_of_type(name: str, definition: str) -> MessagePlan:
    return plan_of(name, definition)


def decodes(plan: MessagePlan, rows: list[bytes]) -> bool:
    joined, ends = b"".join(rows), np.cumsum([len(row) for row in rows])
    with memory_of(MEMORY_OF_PLANS + MEMORY_PER_BYTE * len(joined)):
        try:
            columns = decode(plan, joined, ends)
        except MalformedMessage:
            return False
    assert all(len(column) == len(rows) for column in columns.values())
    return True


if __name__ == "__main__":
    sys.exit(mutation.main(target, "messages"))
