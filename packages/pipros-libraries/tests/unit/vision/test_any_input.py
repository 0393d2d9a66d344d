"""Every message or file results in a value of the documented type, or in the documented error."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pictures
from sensor_msgs.msg import Image

from cv_bridge import CvBridge, CvBridgeError
from pipros_libraries.pictures.codecs import PillowCodec
from pipros_libraries.pictures.encodings import COLORS, DTYPES
from pipros_libraries.vision.calibration import (
    Calibration,
    CalibrationError,
    format_yaml,
    parse_ini,
    parse_yaml,
)
from pipros_libraries.vision.compressed_images import (
    CompressionError,
    CompressionSettings,
    compressed,
    decompressed,
)

BRIDGE = CvBridge()
PILLOW = PillowCodec(Pictures)
NAMES = st.sampled_from([*COLORS, *(f"{depth}C{n}" for depth in DTYPES for n in (1, 3, 9))]) | st.text(
    max_size=9
)
SIZES = st.integers(0, 12) | st.integers(0, 2**32 - 1)
GOOD = Calibration("a", 1, 1, "plumb_bob", (0.0,) * 5, (1.0,) * 9, (1.0,) * 9, (1.0,) * 12)


@given(SIZES, SIZES, NAMES, st.booleans(), SIZES, st.binary(max_size=600), NAMES | st.just("passthrough"))
def test_an_image_is_an_array_or_refused(
    height: int, width: int, encoding: str, big: bool, step: int, data: bytes, desired: str
) -> None:
    message = Image(
        height=height, width=width, encoding=encoding, is_bigendian=int(big), step=step, data=data
    )
    try:
        image = BRIDGE.imgmsg_to_cv2(message, desired)
    except CvBridgeError:
        return
    assert image.shape[:2] == (height, width)
    assert image.dtype.isnative


@given(st.text() | st.sampled_from(["rgb8; jpeg compressed bgr8", "32FC1; compressedDepth"]), st.binary())
def test_compressed_octets_are_an_image_or_refused(kind: str, data: bytes) -> None:
    try:
        image, _ = decompressed(kind, data, PILLOW)
    except CompressionError:
        return
    assert image.ndim in (2, 3)


@given(st.data())
def test_a_damaged_picture_is_an_image_or_refused(data: st.DataObject) -> None:
    kind, whole = compressed(
        np.arange(48, dtype=np.uint8).reshape(4, 4, 3),
        "rgb8",
        CompressionSettings(data.draw(st.sampled_from(["png", "jpeg"]))),
        PILLOW,
    )
    place = data.draw(st.integers(0, len(whole) - 1))
    damaged = whole[:place] + data.draw(st.binary(max_size=4)) + whole[place + data.draw(st.integers(0, 4)) :]
    try:
        image, _ = decompressed(kind, damaged, PILLOW)
    except CompressionError:
        return
    assert image.ndim in (2, 3)


@given(st.data())
def test_a_damaged_calibration_is_read_or_refused(data: st.DataObject) -> None:
    whole = format_yaml(GOOD)
    place = data.draw(st.integers(0, len(whole) - 1))
    damaged = whole[:place] + data.draw(st.text(max_size=4)) + whole[place + data.draw(st.integers(0, 9)) :]
    for parse in (parse_yaml, parse_ini):
        try:
            found = parse(damaged)
        except CalibrationError:
            continue
        assert (len(found.k), len(found.r), len(found.p)) == (9, 9, 12)
