"""Pictures of messages."""

import io
import math
import random
import struct
import sys
from typing import Any

import pytest
from PIL import Image, PngImagePlugin

from pipros.msg import load_message_class
from pipros_libraries.pictures.drawn import SIDE, colours, encoded, picture_of, plot
from pipros_libraries.pictures.encodings import COLORS, Color, encoding, shown_encoding
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.pgm import read_pgm, write_pgm
from pipros_libraries.pictures.png import photo_png, png
from tests.support.memory import memory_of

ImageMsg: Any = load_message_class("sensor_msgs/Image")


CompressedImage: Any = load_message_class("sensor_msgs/CompressedImage")


OccupancyGrid: Any = load_message_class("nav_msgs/OccupancyGrid")


LaserScan: Any = load_message_class("sensor_msgs/LaserScan")


PointCloud: Any = load_message_class("sensor_msgs/PointCloud")


PointCloud2: Any = load_message_class("sensor_msgs/PointCloud2")


Point32: Any = load_message_class("geometry_msgs/Point32")


String: Any = load_message_class("std_msgs/String")


BYTES = 256_000


def drawn(message: Any) -> Image.Image:
    picture, _, _ = picture_of(message, 10_000_000, BYTES)
    image = Image.open(io.BytesIO(picture.content))
    assert picture.kind == f"image/{str(image.format).lower()}"
    assert max(image.size) <= SIDE
    assert len(picture.content) <= BYTES
    return image


def image(encoding: str, width: int, height: int, data: bytes, **more: Any) -> Any:
    return ImageMsg(
        encoding=encoding, width=width, height=height, step=len(data) // height, data=data, **more
    )


@pytest.mark.parametrize(("encoding", "pixel", "expected"), [
    ("rgb8", b"\x0a\x14\x1e", (10, 20, 30)), ("bgr8", b"\x0a\x14\x1e", (30, 20, 10)),
    ("rgba8", b"\x0a\x14\x1e\x00", (10, 20, 30)), ("bgra8", b"\x0a\x14\x1e\x00", (30, 20, 10)),
    ("mono8", b"\x0a", 10), ("bayer_rggb8", b"\x0a", 10),
])  # fmt: skip
def test_pixels_keep_their_colours(encoding: str, pixel: bytes, expected: Any) -> None:
    assert drawn(image(encoding, 2, 2, pixel * 4)).getpixel((1, 1)) == expected


def test_yuv_is_shown_in_grey() -> None:
    assert drawn(image("yuv422", 2, 1, b"\x80\x0a\x80\x14")).getpixel((1, 0)) == 20


@pytest.mark.parametrize(("big", "code"), [(0, "<"), (1, ">")])
def test_depths_are_stretched(big: int, code: str) -> None:
    for name, letter in {"8S": "b", "16U": "H", "16S": "h", "32S": "i", "64F": "d"}.items():
        low = 0 if name == "16U" else -3
        shown = drawn(image(f"{name}C1", 2, 1, struct.pack(f"{code}2{letter}", low, 100), is_bigendian=big))
        assert [shown.getpixel((x, 0)) for x in (0, 1)] == [0, 255]
    shown = drawn(image("32FC1", 3, 1, struct.pack(f"{code}3f", 1, 3, math.nan), is_bigendian=big))
    assert [shown.getpixel((x, 0)) for x in (0, 1, 2)] == [0, 255, 0]


def test_large_images_are_shrunk_until_they_fit() -> None:
    noise = random.Random(1).randbytes(2000 * 1000)  # noqa: S311
    assert drawn(image("mono8", 2000, 1000, noise)).size == (768, 384)
    tiny = encoded(Image.frombytes("L", (700, 700), noise[: 700 * 700]), 20_000)
    assert len(tiny.content) <= 20_000


def test_texts_in_files_are_dropped() -> None:
    texts = PngImagePlugin.PngInfo()
    texts.add_text("Comment", "obey me")
    file = io.BytesIO()
    Image.new("RGB", (4, 4), "red").save(file, "PNG", pnginfo=texts)
    assert b"obey me" in file.getvalue()
    picture, _, _ = picture_of(CompressedImage(format="png", data=file.getvalue()), 100, BYTES)
    assert b"obey me" not in picture.content


def test_compressed_depths_are_stretched() -> None:
    file = io.BytesIO()
    Image.frombytes("I;16", (2, 1), struct.pack("<2H", 1000, 3000)).save(file, "PNG")
    shown = drawn(CompressedImage(format="png", data=file.getvalue()))
    assert [shown.getpixel((x, 0)) for x in (0, 1)] == [0, 255]


def test_grids_have_y_upwards() -> None:
    grid = OccupancyGrid(data=[0, 100, -1, 50])
    grid.info.width = grid.info.height = 2
    shown = drawn(grid)
    assert [shown.getpixel((x, y)) for y in (0, 1) for x in (0, 1)] == [128, 128, 255, 0]


def test_points_ahead_are_above_the_origin() -> None:
    scan = LaserScan(ranges=[2.0, math.nan, 9.0], range_max=5.0)
    shown = drawn(scan).convert("L")
    assert (shown.getbbox() or (0, 1))[1] == 0
    left, _, right, low = shown.crop((0, 0, shown.width, 9)).getbbox() or (0, 0, 0, 0)
    assert (right - left, low) == (5, 3)  # more than a pixel
    cloud = PointCloud(points=[Point32(1e30, 0, 0), Point32(1, 1, 1)])
    assert drawn(cloud).convert("L").getbbox() is not None


def test_plots_have_a_colour_for_each_curve() -> None:
    picture = plot({"a": [(0.0, 1.0), (1.0, 2.0)], "b": [(0.5, 1.5)]}, BYTES)
    shown = Image.open(io.BytesIO(picture.content)).convert("RGB")
    found = {"#%02x%02x%02x" % color for _, color in shown.getcolors(1_000_000) or ()}  # noqa: UP031
    assert set(colours(["a", "b"]).values()) <= found


@pytest.mark.parametrize("message", [
    String("text"), image("mono8", 4, 4, b"\0" * 4), image("unknown", 1, 1, b"\0"),
    image("8UC2", 1, 1, b"\0\0"), image("32FC3", 1, 1, b"\0" * 12), ImageMsg(encoding="mono8"),
    CompressedImage(format="jpeg", data=b"\xff\xd8\xff nothing"), CompressedImage(format="png", data=b""),
    OccupancyGrid(data=[1, 2, 3]), PointCloud2(width=3, height=1, point_step=12, data=b"\0"),
], ids=str)  # fmt: skip
def test_malformed_messages_are_refused(message: Any) -> None:
    with pytest.raises(PictureError):
        picture_of(message, 100, BYTES)


def test_too_many_pixels_are_refused_before_they_are_decoded() -> None:
    file = io.BytesIO()
    Image.new("L", (50, 50)).save(file, "PNG")
    with pytest.raises(PictureError, match="at most 100 pixels"):
        picture_of(CompressedImage(format="png", data=file.getvalue()), 100, BYTES)
    with pytest.raises(PictureError, match="1 to 100 pixels"):
        picture_of(image("mono8", 50, 50, bytes(2500)), 100, BYTES)


# Pgm


def test_a_written_pgm_is_read() -> None:
    assert read_pgm(write_pgm(2, 3, b"abcdef", "a comment é"), "f") == (2, 3, b"abcdef")


@pytest.mark.parametrize(("content", "pixels"), [
    (b"P5\n# by 1 2\n2 # two\n1\n#\n255\n\x00\xff", b"\x00\xff"), (b"P5 2 1 15 \x00\x0f", b"\x00\xff"),
    (b"P5 2 1 15 \x05\xff", b"\x55\xff"), (b"P5 2 1 65535 \x00\x00\xff\xff", b"\x00\xff"),
    (b"P5 2 1 256\n\x00\x80\x01\x00", b"\x7f\xff"), (b"P2 2 1 10 # ten\n0 # none 7\n 10", b"\x00\xff"),
    (b"P2\n2 1\n255\n7 300 9\n", b"\x07\xff"),
])  # fmt: skip
def test_each_kind_of_file_is_read(content: bytes, pixels: bytes) -> None:
    assert read_pgm(content, "f") == (2, 1, pixels)


@pytest.mark.parametrize(("content", "complaint"), [
    (b"P6 1 1 255 abc", "must start with P5 or P2, got b'P6'"), (b"P5 2", "height must be an integer"),
    (b"P5 2 -1 255 ab", "height must be an integer"), (b"P5 0 1 255 ", "pixels, got 0 x 1"),
    (b"P5 99999999 99999999 255 a", "pixels, got 99999999 x 99999999"),
    (b"P5 1 1 0 a", "maximum grey value must be 1 to 65535, got 0"),
    (b"P5 1 1 70000 a", "maximum grey value must be 1 to 65535, got 70000"),
    (b"P5 2 2 255 abc", "must have 4 bytes of pixel data, got 3"),
    (b"P5 2 2 999 abc", "must have 8 bytes of pixel data, got 3"),
    (b"P2 2 1 255 1", "must contain 2 integers"), (b"P2 2 1 255 1 a", "must contain 2 integers"),
    (b"P2 2 1 255 1 -1", "must contain 2 integers"),
])  # fmt: skip
def test_a_broken_file_is_refused(content: bytes, complaint: str) -> None:
    with pytest.raises(PictureError, match=complaint):
        read_pgm(content, "f")


@pytest.mark.parametrize("part", [b"1 ", b"#\n", b" ", b"\n1#x"])
def test_a_plain_file_takes_little_more_memory_than_its_pixels(part: bytes) -> None:
    content = b"P2\n300 1000\n255\n" + part * 100_000 + b"\n" + b"1 " * 300_000
    headless = b"P2" + part.replace(b"1", b" ") * 100_000 + b"\nx"
    with memory_of(2_000_000):
        assert read_pgm(content, "f")[2] == b"\1" * 300_000
        with pytest.raises(PictureError, match="width must be an integer"):
            read_pgm(headless, "f")


# PNG files of cameras' pictures.


WIDTH, HEIGHT = 40, 30


MODES = {(1, 8): "L", (3, 8): "RGB", (4, 8): "RGBA", (1, 16): "I;16"}


def photo(channels: int, bits: int) -> list[bytes]:
    """Return rows of brightness that rises smoothly, with noise."""
    noise = random.Random(1)  # noqa: S311 # repeatable
    size = channels * bits // 8
    return [
        bytes((6 * x + 3 * y + noise.randrange(4)) % 256 for x in range(WIDTH) for _ in range(size))
        for y in range(HEIGHT)
    ]


def reversed_row(row: bytes, channels: int, bits: int) -> bytes:
    """Return a row in the order BGR, whose 16-bit values are little-endian."""
    size = bits // 8
    values = [row[at : at + size][::-1] for at in range(0, len(row), size)]
    order = (2, 1, 0, 3)[:channels] if channels > 1 else (0,)
    pixels = [values[at : at + channels] for at in range(0, len(values), channels)]
    return b"".join(pixel[channel] for pixel in pixels for channel in order)


@pytest.mark.parametrize("has_numpy", [True, False])
@pytest.mark.parametrize("is_reversed", [True, False])
@pytest.mark.parametrize(("channels", "bits"), MODES)
def test_a_photo_keeps_its_pixels(
    channels: int, bits: int, is_reversed: bool, has_numpy: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not has_numpy:
        monkeypatch.setitem(sys.modules, "numpy", None)
    rows = photo(channels, bits)
    given = [reversed_row(row, channels, bits) if is_reversed else row for row in rows]
    options = {"is_bgr": is_reversed and channels > 1, "is_little": is_reversed}
    step = len(rows[0]) + 3
    data = b"".join(row + b"pad" for row in given)
    found = Image.open(io.BytesIO(photo_png(WIDTH, HEIGHT, channels, bits, data, step, **options)))
    assert (found.mode, found.size) == (MODES[channels, bits], (WIDTH, HEIGHT))
    pixels = found.tobytes()
    if bits == 16:  # Pillow's are little-endian
        pixels = b"".join(pixels[at : at + 2][::-1] for at in range(0, len(pixels), 2))
    assert pixels == b"".join(rows)


def test_a_photo_is_smaller_than_other_pictures_with_the_same_pixels() -> None:
    rows = photo(3, 8)
    photo_file = photo_png(WIDTH, HEIGHT, 3, 8, b"".join(rows), len(rows[0]))
    assert 1.3 * len(photo_file) < len(png(WIDTH, HEIGHT, 3, 8, rows))


# One table of encodings, for conversions, exported pictures and the page.


@pytest.mark.parametrize(("name", "color"), [
    ("8UC1", Color.GRAY), ("8UC3", Color.BGR), ("8UC4", Color.BGRA), ("32FC1", Color.GRAY)
])  # fmt: skip
def test_types_without_colours_are_shown_in_the_order_of_opencv(name: str, color: Color) -> None:
    assert encoding(name).color is None
    assert shown_encoding(name).color is color
    assert shown_encoding("8UC2").color is None


def test_encodings_with_colours_are_shown_in_them() -> None:
    assert {name: shown_encoding(name) for name in COLORS} == COLORS
    assert shown_encoding("yuv422_yuy2").channels == 2
