"""Compressed images: format strings, JPEG and PNG, depths."""

import io
import struct
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pictures
from sensor_msgs.msg import Image

from cv_bridge import CvBridge, CvBridgeError
from pipros.basics.extras import install_command
from pipros_libraries.pictures.codecs import OpenCVCodec, PillowCodec, codec, pixel_count
from pipros_libraries.pictures.compressed import PNG as PNG_START
from pipros_libraries.pictures.encodings import COLORS, DTYPES
from pipros_libraries.pictures.errors import PictureError
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
    DepthSettings,
    compressed,
    compressed_by,
    compressed_depth,
    decompressed,
    read_settings,
)

PILLOW = PillowCodec(Pictures)


PNG = CompressionSettings("png")


RAMP = np.arange(0, 240, dtype=np.uint8).reshape(8, 10, 3)


def both_ways(image: Any, encoding: str, settings: CompressionSettings) -> tuple[str, Any, str]:
    kind, data = compressed(image, encoding, settings, PILLOW)
    return kind, *decompressed(kind, data, PILLOW)


@pytest.mark.parametrize(("encoding", "shape", "kind"), [
    ("rgb8", (8, 10, 3), "rgb8; png compressed bgr8"), ("bgr8", (8, 10, 3), "bgr8; png compressed bgr8"),
    ("mono8", (8, 10), "mono8; png compressed "), ("bayer_rggb8", (8, 10), "bayer_rggb8; png compressed "),
    ("8UC3", (8, 10, 3), "8UC3; png compressed "), ("8UC1", (8, 10), "8UC1; png compressed "),
])  # fmt: skip
def test_png_keeps_every_value(encoding: str, shape: tuple[int, ...], kind: str) -> None:
    image = np.random.RandomState(1).randint(0, 256, shape).astype(np.uint8)

    found = both_ways(image, encoding, PNG)
    assert (found[0], found[1].tolist(), found[2]) == (kind, image.tolist(), encoding)


@pytest.mark.parametrize("encoding", ["mono16", "16UC1"])
def test_png_keeps_values_of_16_bits(encoding: str) -> None:
    image = np.arange(0, 65280, 816, dtype=np.uint16).reshape(8, 10)

    assert np.array_equal(both_ways(image, encoding, PNG)[1], image)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8"])
def test_jpeg_comes_near(encoding: str) -> None:
    kind, image, found = both_ways(RAMP, encoding, CompressionSettings(jpeg_quality=95))

    assert (kind, found) == (f"{encoding}; jpeg compressed bgr8", encoding)
    assert np.abs(image.astype(int) - RAMP).max() < 12


def test_jpeg_has_the_upper_half_of_16_bits() -> None:
    kind, image, _ = both_ways(np.full((8, 8), 0x8042, np.uint16), "mono16", CompressionSettings())

    assert (kind, image.dtype, image[0, 0]) == ("mono16; jpeg compressed ", np.uint16, 0x8000)


def test_alpha_is_dropped_as_in_genuine_ros() -> None:
    image = np.dstack([RAMP, np.full((8, 10), 7, np.uint8)])

    assert both_ways(image, "bgra8", PNG)[1][0, 1].tolist() == [3, 4, 5, 255]


def test_a_format_without_encoding_is_what_the_picture_shows() -> None:
    assert decompressed("png", PILLOW.encode(RAMP, "png", 9), PILLOW)[1] == "bgr8"
    assert decompressed("", PILLOW.encode(RAMP[:, :, 0], "png", 9), PILLOW)[1] == "mono8"


def test_an_old_picture_has_the_colors_in_the_order_of_its_encoding() -> None:
    data = PILLOW.encode(RAMP, "png", 9)

    assert np.array_equal(decompressed("rgb8; png compressed ", data, PILLOW)[0], RAMP)


def test_a_picture_with_other_channels_than_its_encoding_is_converted() -> None:
    gray = RAMP[:, :, 0]
    data = PILLOW.encode(gray, "png", 9)

    colored, _ = decompressed("rgb8; jpeg compressed bgr8", data, PILLOW)
    back, _ = decompressed("mono8; jpeg compressed ", PILLOW.encode(np.dstack([gray] * 3), "png", 9), PILLOW)

    assert np.array_equal(colored, np.dstack([gray] * 3))
    assert np.array_equal(back, gray)


def test_depths_are_read() -> None:
    steps = np.array([[0, 1, 3]], np.uint16)
    header = struct.pack("<iff", 0, 8.0, -1.0)
    data = header + PILLOW.encode(steps, "png", 9)

    depths, encoding = decompressed("32FC1; compressedDepth", data, PILLOW)

    assert (encoding, depths.dtype) == ("32FC1", np.float32)
    assert np.array_equal(depths, np.array([[np.nan, 4.0, 2.0]], np.float32), equal_nan=True)
    assert decompressed("16UC1; compressedDepth png", data, PILLOW)[0].tolist() == [[0, 1, 3]]


@pytest.mark.parametrize(("kind", "data", "text"), [
    ("jpeg", b"", r"cannot decode the image \(0 bytes\)"),
    ("jpeg", b"\xff\xd8\xff broken", "cannot decode the image"),
    ("rgb8; png compressed bgr8", PILLOW.encode(RAMP, "png", 9)[:-60], "cannot decode the image"),
    ("xyz; jpeg compressed ", PILLOW.encode(RAMP, "jpeg", 80), r"Unrecognized image encoding \[xyz\]"),
    ("32FC1; compressedDepth", b"short", "must have more than 12 bytes, got 5"),
    ("32FC1; compressedDepth", bytes(12) + PILLOW.encode(RAMP, "png", 9), "must have one channel, got 3"),
    ("8UC1; compressedDepth", bytes(12) + PILLOW.encode(RAMP[:, :, 0], "png", 9), r"got \[8UC1\]"),
])  # fmt: skip
def test_undecodable_images_are_refused(kind: str, data: bytes, text: str) -> None:
    with pytest.raises(CompressionError, match=text):
        decompressed(kind, data, PILLOW)


@pytest.mark.parametrize(("image", "encoding", "kind", "text"), [
    (np.zeros((2, 2), np.float32), "32FC1", "jpeg", r"jpeg requires 8-bit or 16-bit values, got \[32FC1\]"),
    (np.zeros((2, 2, 3), np.uint16), "rgb16", "png", r"Pillow cannot write an array of uint16.*\[vision\]"),
    (RAMP, "xyz", "png", "Unrecognized image encoding"),
    (np.zeros((0, 0), np.uint8), "mono8", "png", "Pillow cannot write"),
])  # fmt: skip
def test_unsupported_images_cannot_be_compressed(image: Any, encoding: str, kind: str, text: str) -> None:
    with pytest.raises(CompressionError, match=text):
        compressed(image, encoding, CompressionSettings(kind), PILLOW)


def test_settings_outside_of_their_limits_are_refused() -> None:
    with pytest.raises(CompressionError, match="must be jpeg or png, got 'gif'"):
        CompressionSettings("gif")
    with pytest.raises(CompressionError, match="jpeg_quality must be an integer from 1 to 100, got 0"):
        CompressionSettings(jpeg_quality=0)


def test_only_jpeg_and_png_images_are_opened() -> None:
    file = io.BytesIO()
    Pictures.new("RGB", (2, 2)).save(file, "BMP")

    with pytest.raises(PictureError):
        PILLOW.decode(file.getvalue())


def test_a_palette_becomes_colors() -> None:
    file = io.BytesIO()
    Pictures.new("P", (2, 2)).save(file, "PNG")

    assert PILLOW.decode(file.getvalue()).shape == (2, 2, 3)


class FakeOpenCV:
    """The functions of OpenCV that images need."""

    IMREAD_UNCHANGED, IMWRITE_JPEG_QUALITY, IMWRITE_PNG_COMPRESSION = -1, 1, 16
    error = RuntimeError

    @staticmethod
    def imdecode(octets: Any, flags: int) -> Any:
        return RAMP if octets.tobytes() == b"\xff\xd8good" else None

    @staticmethod
    def imencode(ending: str, image: Any, options: list[int]) -> tuple[bool, Any]:
        if image.dtype == np.int8:
            raise RuntimeError("depth")
        return image.size > 0, np.frombuffer(f"{ending} {options}".encode(), np.uint8)


def test_opencv_is_preferred_if_it_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", FakeOpenCV)
    opencv = codec()
    assert isinstance(opencv, OpenCVCodec)

    assert opencv.encode(RAMP, "jpeg", 70) == b".jpg [1, 70]"
    assert opencv.encode(RAMP, "png", 3) == b".png [16, 3]"
    assert opencv.decode(b"\xff\xd8good") is RAMP
    for wrong in (b"", b"\xff\xd8bad"):
        with pytest.raises(PictureError, match="OpenCV cannot decode"):
            opencv.decode(wrong)
    for image in (RAMP.astype(np.int8), RAMP[:0]):
        with pytest.raises(PictureError, match="OpenCV cannot write"):
            opencv.encode(image, "png", 3)


@pytest.mark.parametrize("picture", [
    PNG_START + struct.pack(">I4sII", 13, b"IHDR", 14_000, 14_000),
    b"\xff\xd8\xff\xfe\0\x04abpadding\xff\xff\xc2\0\x11\x08" + struct.pack(">HH", 14_000, 14_000),
    b"II*\0" + struct.pack("<IHHHIIHHII", 8, 2, 256, 4, 1, 14_000, 257, 3, 1, 14_000),
    b"MM\0*" + struct.pack(">IHHHIHHHHII", 8, 2, 256, 3, 1, 14_000, 0, 257, 4, 1, 14_000),
    b"BM" + bytes(12) + struct.pack("<Iii", 40, 14_000, -14_000),
    b"RIFF\0\0\0\0WEBPVP8X" + bytes(8) + (13_999).to_bytes(3, "little") * 2,
    b"\xff\x4f\xff\x51" + struct.pack(">HHIIII", 41, 0, 14_007, 14_003, 7, 3),
], ids=["PNG", "JPEG", "TIFF", "big-endian TIFF", "BMP", "WebP", "JPEG 2000"])  # fmt: skip
def test_opencv_does_not_decode_pictures_with_too_many_pixels(picture: bytes) -> None:
    """14,000 x 14,000 pixels with four channels take 784 MB; a PNG file needs less than 1 MB for them."""
    with pytest.raises(PictureError, match="must have at most 178956970 pixels, got 196000000"):
        OpenCVCodec(FakeOpenCV).decode(picture)


def test_the_headers_that_opencv_writes_are_understood() -> None:
    cv2 = pytest.importorskip("cv2")
    for kind in (".png", ".jpg", ".tiff", ".bmp", ".webp", ".jp2"):
        for channels in (3, 4):
            picture = np.full((70, 130, channels), 128, np.uint8)
            assert pixel_count(bytes(cv2.imencode(kind, picture)[1])) == 9100, (kind, channels)
    lossy = cv2.imencode(".webp", np.zeros((7, 13, 3), np.uint8), [cv2.IMWRITE_WEBP_QUALITY, 50])[1]
    assert (bytes(lossy[12:16]), pixel_count(bytes(lossy))) == (b"VP8 ", 91)
    for cut in (PNG_START, b"II*\0", b"\xff\xd8", b"\xff\xd8\xff\xe0", b"BM", b"RIFF\0\0\0\0WEBPVP8 "):
        assert pixel_count(cut) == 0
    with pytest.raises(PictureError, match="must be a JPEG, PNG, TIFF, BMP, WebP or JPEG 2000 image"):
        OpenCVCodec(cv2).decode(b"P5 30000 30000 255\n")


def test_without_either_library_the_error_names_the_extras() -> None:
    program = (
        "import sys; sys.modules['cv2'] = sys.modules['PIL'] = None\n"
        "from pipros_libraries.pictures.codecs import codec\ncodec()"
    )

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)

    assert f"{install_command('vision')} or {install_command('numpy', 'pictures')}" in ended.stderr


@pytest.mark.parametrize(("encoding", "tolerance"), [("16UC1", 0), ("32FC1", 0.02)])
def test_depths_survive_compression(encoding: str, tolerance: float) -> None:
    metres = np.array([[0.5, 2, 0], [9.5, 4, 20]])
    image = (metres * 1000).astype(np.uint16) if encoding == "16UC1" else metres.astype(np.float32)
    settings = read_settings("compressedDepth", lambda name, default: default)
    name, data = compressed_by(settings, image, encoding, PILLOW)
    assert name == f"{encoding}; compressedDepth png"
    depths, same = decompressed(name, data, PILLOW)
    assert same == encoding
    expected = np.where(metres > 10, 0, metres) * (1000 if encoding == "16UC1" else 1)
    assert np.nan_to_num(depths) == pytest.approx(expected, abs=tolerance * 4)


def test_depths_that_cannot_be_compressed_are_refused() -> None:
    with pytest.raises(CompressionError, match=r"must be 16UC1 or 32FC1, got \[bgr8\]"):
        compressed_depth(RAMP, "bgr8", DepthSettings(), PILLOW)
    wrong: tuple[dict[str, object], ...] = ({"format": "rvl"}, {"depth_max": 0.5}, {"png_level": 10})
    for bad in wrong:
        with pytest.raises(CompressionError, match="must be"):
            read_settings("compressedDepth", lambda name, default, bad=bad: bad.get(name, default))  # type: ignore[misc]


# Every message or file results in a value of the documented type, or in the documented error.


BRIDGE = CvBridge()


NAMES = st.sampled_from([*COLORS, *(f"{depth}C{n}" for depth in DTYPES for n in (1, 3, 9))]) | st.text(
    max_size=9
)


SIZES = st.integers(0, 12) | st.integers(0, 2**32 - 1)


GOOD = Calibration("a", 1, 1, "plumb_bob", (0.0,) * 5, (1.0,) * 9, (1.0,) * 9, (1.0,) * 12)


@given(SIZES, SIZES, NAMES, st.booleans(), SIZES, st.binary(max_size=600), NAMES | st.just("passthrough"))
def test_an_image_is_an_array_or_refused(
    height: int, width: int, encoding: str, big: bool, step: int, data: bytes, desired: str
) -> None:
    given = {"encoding": encoding, "is_bigendian": int(big), "step": step, "data": data}
    try:
        image = BRIDGE.imgmsg_to_cv2(Image(height=height, width=width, **given), desired)
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
        np.arange(48, dtype=np.uint8).reshape(4, 4, 3), "rgb8",
        CompressionSettings(data.draw(st.sampled_from(["png", "jpeg"]))), PILLOW,
    )  # fmt: skip
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
