import random

import lz4.frame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_tools.bag.compression import compress, decompress
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.lz4_frame import decompress_frame, xxh32

CONTENTS = st.one_of(
    st.binary(max_size=300),
    st.builds(lambda part, times: part * times, st.binary(min_size=1, max_size=20), st.integers(0, 5000)),
)


@given(CONTENTS, st.booleans(), st.booleans(), st.booleans())
def test_frames_of_the_library_are_read(data: bytes, is_linked: bool, checks: bool, has_size: bool) -> None:
    frame = lz4.frame.compress(
        data, block_linked=is_linked, block_checksum=checks, content_checksum=checks, store_size=has_size
    )

    assert decompress_frame(frame, len(data), "x") == data


@given(CONTENTS)
def test_compressed_data_is_read_by_both(data: bytes) -> None:
    frame = bytes(compress("lz4", data))

    assert decompress_frame(frame, len(data), "x") == data
    assert decompress("lz4", frame, len(data), "x") == data


def test_frames_may_have_many_blocks() -> None:
    data = random.Random(1).randbytes(1000) * 300  # noqa: S311

    assert decompress_frame(lz4.frame.compress(data, block_size=4), len(data), "x") == data


@pytest.mark.parametrize(("data", "value"), [(b"", 0x02CC5D05), (b"a", 0x550D7456), (b"a" * 40, 0x6A9616D6)])
def test_the_checksum_is_xxh32(data: bytes, value: int) -> None:
    assert xxh32(data) == value


def test_damage_is_detected_within_the_size_limit() -> None:
    data = bytes(range(256)) * 4 + b"hello world " * 2
    frame = bytes(compress("lz4", data))
    rng = random.Random(1)  # noqa: S311
    for at in range(len(frame)):
        broken = bytearray(frame)
        broken[at] ^= 1 << rng.randrange(8)
        with pytest.raises(BagFormatError, match="x: the lz4 data are damaged"):
            decompress_frame(bytes(broken), len(data), "x")
        with pytest.raises(BagFormatError, match="x: the lz4 data are damaged"):
            decompress_frame(frame[:at], len(data), "x")
    with pytest.raises(BagFormatError, match="more bytes than allowed"):
        decompress_frame(frame, len(data) - 1, "x")
