"""Any bytes of a bag are messages or raise BagError, in bounded memory.

python -m tests.fuzz.bags --seconds 60
"""

import contextlib
import io
import sys

from pipros.basics.limits import Limits
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.index import ENTRY
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_text, info_yaml
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.repair import reindex
from tests.fuzz import mutation
from tests.support.constants import changed
from tests.support.memory import memory_of

WORDS = [
    *(b"op=\x02", b"op=\x04", b"op=\x05", b"op=\x06", b"op=\x07", b"\x0d\0\0\0", b"conn=\x01\0\0\0"),
    *(b"size=\xff\xff\xff\x7f", b"compression=bz2", b"compression=lz4", b"index_pos=", b"#ROSBAG V1.2\n"),
    *(b"#ROSBAG V2.0\n", b"ver=\x01\0\0\0", b"count=\xff\xff\xff\xff", b"chunk_pos=", b"encryptor=x"),
]
LIMITS = Limits(bag_cache_bytes=1 << 20)
MEMORY_BYTES = 24 << 20
"""Several chunks of the limit, and what compression needs of its own."""

MEMORY_PER_BYTE = 200


@changed(BAG_CHUNK_BYTES=1 << 20, BAG_HEADER_BYTES=10_000, BAG_RECORDS=1 << 16)
def target(data: bytes) -> None:
    with memory_of(MEMORY_BYTES + MEMORY_PER_BYTE * len(data)):
        for is_rebuilt in (False, True):
            with contextlib.suppress(BagError):
                _read(data, is_rebuilt)
        _repair(data)


def _read(data: bytes, is_rebuilt: bool) -> None:
    bag = BagReader(io.BytesIO(data), rebuild_index=is_rebuilt, limits=LIMITS)
    info = bag_info(bag, "x.bag", with_frequencies=is_rebuilt)
    assert info_text(info)
    assert info_yaml(info)
    count = sum(1 for _ in bag.raw_messages())
    assert is_rebuilt or bag.layout.version.number != 200 or count * ENTRY.size <= len(data)


def _repair(data: bytes) -> None:
    """Check that a repaired bag has an index and all messages that can be read without one."""
    file = io.BytesIO(data)
    try:
        found = sum(1 for _ in BagReader(io.BytesIO(data), rebuild_index=True, limits=LIMITS).raw_messages())
        reindex(file, "x.bag").finish()
    except BagError:
        return
    assert sum(1 for _ in BagReader(file, limits=LIMITS).raw_messages()) == found


if __name__ == "__main__":
    sys.exit(mutation.main(target, "bags", WORDS))
