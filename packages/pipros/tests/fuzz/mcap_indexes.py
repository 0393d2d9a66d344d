"""An MCAP file with a false summary: chunk indexes, statistics, headers and contents are mutated.

An input is changes: the element, the chunk, two numbers. The file is then read like those of `mcap_files`.

python -m tests.fuzz.mcap_indexes --seconds 60
"""

import sys
from struct import Struct

from pipros_tools.bag.mcap_records import McapSummary
from tests.fuzz import mcap_files, mutation
from tests.support.mcap import chunk_record, index_of, mcap_bytes, messages_record, with_summary

CHANGE = Struct("<BBHQ")
MAX_CHANGES = 100
BASE = mcap_bytes(range(60), chunk_bytes=200)
DATA_BYTES = int.from_bytes(BASE[-28:-20], "little")
NUMBERS = [0, 1, 8, 100, 1 << 20, (1 << 32) - 1, 1 << 32, (1 << 62), (1 << 64) - 1]
WORDS = [CHANGE.pack(what, 0, more, value) for what in range(10) for more in (0, 500) for value in NUMBERS]


def target(data: bytes) -> None:
    mcap_files.target(file_of(data))


def file_of(script: bytes) -> bytes:
    """Return the file that an input describes."""
    size = min(len(script) // CHANGE.size, MAX_CHANGES) * CHANGE.size
    changes = list(CHANGE.iter_unpack(script[:size]))
    parts = [chunk_of(*rest) for what, *rest in changes if what % 10 == 8]
    patches: list[tuple[int, bytes]] = []

    def change(summary: McapSummary) -> None:
        end, left = DATA_BYTES, iter(parts)
        for what, which, more, value in changes:
            chunks, statistics = summary.chunk_indexes, summary.statistics
            chunk = chunks[which % len(chunks)] if chunks else index_of(0)
            match what % 10:
                case 0:
                    chunks.extend([chunk] * (more % 50))
                case 1:
                    chunks.append(index_of(value, start=which, end=more))
                case 2:
                    chunks.append(index_of(min(chunk.chunk_start_offset + value % 300, 1 << 63)))
                case 3:
                    chunk.message_start_time, chunk.message_end_time = value, more
                case 4:
                    chunk.compressed_size = chunk.uncompressed_size = value
                case 5:
                    statistics.message_count = statistics.message_start_time = value
                case 6:
                    statistics.channel_message_counts[which] = value
                case 7:
                    place = (which * 256 + more) % DATA_BYTES
                    patches.append((place, value.to_bytes(8, "little")[: 1 + more % 8]))
                case 8:
                    chunks.append(index_of(end, start=0, end=1 << 62))
                    end += len(next(left))
                case _:
                    del chunks[: more % 30]

    data = bytearray(with_summary(BASE, change, b"".join(parts)))
    for place, piece in patches:
        data[place : place + len(piece)] = piece
    return bytes(data)


def chunk_of(which: int, more: int, value: int) -> bytes:
    content = messages_record([value & ((1 << 62) - 1)] * (more % 600))
    claimed = None if which else min(value, 1 << 63)
    return chunk_record(content, size=claimed, compression="zstd" if which % 2 else "")


if __name__ == "__main__":
    sys.exit(mutation.main(target, "mcap_indexes", WORDS))
