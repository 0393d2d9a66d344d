"""Any definition and bytes become a message whose memory is in proportion to the bytes, or raise an error.

An input is the definition, a line `===`, and the bytes.

python -m tests.fuzz.strange_messages --seconds 60
"""

import logging
import sys

from pipros.msg.compile.arrays import EMPTY_ELEMENTS
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import DeserializationError
from pipros.msg.language.spec import DefinitionError
from tests.fuzz import mutation
from tests.fuzz.definitions import LIMITS
from tests.fuzz.definitions import WORDS as DEFINITION_WORDS
from tests.support.memory import memory_of

WORDS = [
    *DEFINITION_WORDS,
    *(b"E[] es\n", b"E[100] es\n", b"E e\n", b"bool[0] n\n", b"bool b\n", b"\nMSG: a/E\n", b"\n===\n"),
    *(number.to_bytes(4, "little") for number in (1, 100, 60_000, 1_000_000)),
]
LIMIT_BYTES = 200 * EMPTY_ELEMENTS
"""What elements without bytes may take, and the first use of a reader."""

MEMORY_PER_BYTE = 600
"""Up to eight values, each an object in a list."""


def target(data: bytes) -> None:
    text, _, body = data.partition(b"\n===\n")
    try:
        cls = message_classes_from_text("a/T", text.decode("utf-8", "replace"), LIMITS)["a/T"]
    except DefinitionError:
        return
    with memory_of(LIMIT_BYTES + MEMORY_PER_BYTE * len(body)):
        try:
            cls._from_bytes(body)
        except DeserializationError:
            return


if __name__ == "__main__":
    logging.disable()  # each type logs its first string that is not UTF-8
    sys.exit(mutation.main(target, "strange_messages", WORDS))
