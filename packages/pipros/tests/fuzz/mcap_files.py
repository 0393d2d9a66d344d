"""Any bytes of an MCAP file are messages or raise BagError, in bounded memory.

python -m tests.fuzz.mcap_files --seconds 60
"""

import contextlib
import io
import sys
import tempfile

from pipros.basics.limits import Limits
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_text
from pipros_tools.bag.mcap_files import McapReader
from pipros_tools.bag.mcap_repair import recover
from tests.fuzz import mutation
from tests.support.constants import changed
from tests.support.memory import memory_of

WORDS = [
    *(b"ros1", b"ros1msg", b"zstd", b"lz4", b"\x89MCAP0\r\n", b"cdr", b"md5sum", b"std_msgs/String"),
    *(bytes([op]) + bytes([1, 0, 0, 0, 0, 0, 0, 0]) for op in range(1, 16)),
]
LIMITS = Limits(bag_cache_bytes=1 << 20)
MEMORY_BYTES = 24 << 20
"""Several chunks of the limit, and what compression needs of its own."""

MEMORY_PER_BYTE = 200


@changed(BAG_CHUNK_BYTES=1 << 20, BAG_HEADER_BYTES=10_000, BAG_RECORDS=1 << 16)
def target(data: bytes) -> None:
    with memory_of(MEMORY_BYTES + MEMORY_PER_BYTE * len(data)):
        with contextlib.suppress(BagError):
            bag = McapReader(io.BytesIO(data), limits=LIMITS)
            assert info_text(bag_info(bag, "x.mcap", with_frequencies=True))
            for _ in bag.raw_messages():
                pass
        _repair(data)


def _repair(data: bytes) -> None:
    """Check that a repaired file can be read completely."""
    made = io.BytesIO()
    with tempfile.NamedTemporaryFile() as file:
        file.write(data)
        file.flush()
        try:
            recover(file.name, made, lambda _: None)
        except BagError:
            return
    try:
        bag = McapReader(made, limits=LIMITS)
    except BagError as error:
        if "no topic can be read" in str(error):  # records of other encodings are copied, too
            return
        raise
    for _ in bag.raw_messages():
        pass


if __name__ == "__main__":
    sys.exit(mutation.main(target, "mcap_files", WORDS))
