"""A bag with a false index: chunk infos, chunk headers and index records are mutated.

An input is the kind of bag, then changes: the element, the chunk, two numbers. The bag is then read like
those of `bags`.

python -m tests.fuzz.bag_indexes --seconds 60
"""

import io
import sys
from dataclasses import replace
from struct import Struct

from pipros.msg.time import NS_PER_S
from pipros_tools.bag import BagReader, BagWriter
from tests.fuzz import bags, mutation
from tests.support.bags import bag_bytes, some_rows

CHANGE = Struct("<BBHQ")
MAX_CHANGES = 100
BASES = [
    bag_bytes(some_rows(60), chunk_bytes=300, compression=compression)
    for compression in ("none", "bz2", "lz4")
]
NUMBERS = [0, 1, 12, 100, 4117, 1 << 20, (1 << 31) - 1, (1 << 32) - 1, 1 << 32, (1 << 64) - 1]
WORDS = [CHANGE.pack(what, 0, more, value) for what in range(8) for more in (0, 50) for value in NUMBERS]

LATEST_NS = 2**32 * NS_PER_S


def target(data: bytes) -> None:
    bags.target(bag_of(data))


def bag_of(script: bytes) -> bytes:
    """Return the bag that an input describes."""
    base = BASES[script[0] % len(BASES) if script else 0]
    layout = BagReader(io.BytesIO(base)).layout
    data = bytearray(base[: layout.end])
    chunks = list(layout.chunks)
    size = min(len(script[1:]) // CHANGE.size, MAX_CHANGES) * CHANGE.size
    for what, which, more, value in CHANGE.iter_unpack(script[1 : 1 + size]):
        at = which % len(chunks)
        chunk = chunks[at]
        number = value & 0xFFFFFFFF
        match what % 8:
            case 0:
                chunks += [chunk] * (more % 50)
            case 1:
                chunks[at] = replace(chunk, position=value)
            case 2:
                chunks[at] = replace(chunk, position=chunks[more % len(chunks)].position + value % 500)
            case 3:
                chunks[at] = replace(chunk, counts={**chunk.counts, more % 4: number})
            case 4:
                chunks[at] = replace(chunk, start_ns=(value * NS_PER_S + number) % LATEST_NS)
            case 5:
                chunks[at] = replace(chunk, end_ns=(value * NS_PER_S + number) % LATEST_NS)
            case 6:
                place = min(chunk.position + more % 600, len(data) - 4)
                data[place : place + 4] = number.to_bytes(4, "little")
            case _:
                place = min(chunk.position, len(data))
                data += data[place : place + more]
    layout.chunks[:] = chunks
    layout.end = len(data)
    file = io.BytesIO(data)
    BagWriter(file, layout=layout).finish()
    return file.getvalue()


if __name__ == "__main__":
    sys.exit(mutation.main(target, "bag_indexes", WORDS))
