"""Any bytes are a message, or raise DeserializationError.

An input names its type in the first line: `sensor_msgs/Image`, a newline, the bytes.

python -m tests.fuzz.messages --seconds 60
"""

import io
import sys

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.base import Message
from pipros.msg.errors import DeserializationError, SerializationError
from tests.fuzz import mutation
from tests.support.memory import memory_of

MEMORY_PER_BYTE = 400
"""A bool takes one byte in a message and up to 8 in a list; a message in an array takes more."""


MEMORY_OF_A_COMPILER = 4_000_000
"""The first string of a type that is not UTF-8 compiles a reader; the very first one imports `logging`."""


def target(data: bytes) -> None:
    name, _, body = data.partition(b"\n")
    try:
        cls = load_message_class(name.decode("ascii", "replace"))
    except PiprosError:
        return
    read(cls, body)
    read(cls, memoryview(body))


def read(cls: type[Message], body: bytes | memoryview) -> None:
    with memory_of(MEMORY_OF_A_COMPILER + MEMORY_PER_BYTE * len(body)):
        try:
            message = cls._from_bytes(body)
        except DeserializationError:
            return
    try:
        first = written(message)
    except SerializationError:
        return  # a time whose nanoseconds, carried over, leave no room for its seconds
    assert written(cls._from_bytes(first)) == first


def written(message: Message) -> bytes:
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


if __name__ == "__main__":
    sys.exit(mutation.main(target, "messages"))
