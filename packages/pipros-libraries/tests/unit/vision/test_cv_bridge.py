"""cv_bridge: conversion of image messages to arrays, and back."""

import struct
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from sensor_msgs import image_encodings
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

import cv_bridge
from cv_bridge import CvBridge, CvBridgeError, cvtColor2, cvtColorForDisplay, getCvType
from pipros.basics.extras import install_command

BRIDGE = CvBridge()
COLORED = np.array([[[10, 20, 30], [255, 0, 0]], [[0, 255, 0], [0, 0, 255]]], np.uint8)

# The results of genuine cv_bridge for COLORED with OpenCV 4.6.
GRAY_OF_RGB = [[18, 76], [150, 29]]
GRAY_OF_BGR = [[22, 29], [150, 76]]


def message(image: Any, encoding: str) -> Image:
    return BRIDGE.cv2_to_imgmsg(image, encoding)


@pytest.mark.parametrize(("encoding", "gray"), [("rgb8", GRAY_OF_RGB), ("bgr8", GRAY_OF_BGR)])
def test_colors_become_gray_with_the_rounding_of_opencv(encoding: str, gray: list[list[int]]) -> None:
    assert BRIDGE.imgmsg_to_cv2(message(COLORED, encoding), "mono8").tolist() == gray


def test_channels_are_put_in_another_order_and_alpha_is_opaque() -> None:
    image = BRIDGE.imgmsg_to_cv2(message(COLORED, "rgb8"), "bgra8")

    assert image.tolist()[0] == [[30, 20, 10, 255], [0, 0, 255, 255]]
    assert image.flags.c_contiguous


def test_white_stays_white_between_8_and_16_bits() -> None:
    wide = cvtColor2(COLORED, "rgb8", "bgr16")

    assert (wide.dtype, wide[0, 1].tolist()) == (np.uint16, [0, 0, 65535])
    assert np.array_equal(cvtColor2(wide, "bgr16", "rgb8"), COLORED)


def test_numbers_are_rounded_half_to_even_and_limited() -> None:
    depths = np.array([[0.5, 1.5, -3.0, 300.0, np.nan, 1e12]], np.float32)

    assert cvtColor2(depths, "32FC1", "8UC1").tolist() == [[0, 2, 0, 255, 0, 0]]
    assert cvtColor2(depths, "32FC1", "32SC1").tolist() == [[0, 2, -3, 300, -(2**31), -(2**31)]]


def test_a_bayer_pattern_and_yuv_become_colors() -> None:
    pattern = np.arange(16, dtype=np.uint8).reshape(4, 4) * 10
    pixels = np.array([[[128, 16], [128, 235]], [[255, 81], [0, 145]]], np.uint8)

    assert cvtColor2(pattern, "bayer_rggb8", "rgb8")[1].tolist() == [[50] * 3, [50] * 3, [60] * 3, [60] * 3]
    assert cvtColor2(pixels, "yuv422", "rgb8")[0].tolist() == [[0, 0, 0], [255, 255, 255]]
    assert cvtColor2(pixels, "yuv422", "mono8").tolist() == [[16, 235], [81, 145]]


def test_rows_may_be_padded() -> None:
    padded = Image(height=2, width=1, encoding="rgb8", step=5, data=b"\1\2\3__\4\5\6")

    assert BRIDGE.imgmsg_to_cv2(padded).tolist() == [[[1, 2, 3]], [[4, 5, 6]]]


def test_a_missing_step_means_no_padding() -> None:
    image = Image(height=2, width=2, encoding="mono8", step=0, data=b"\1\2\3\4")

    assert BRIDGE.imgmsg_to_cv2(image).tolist() == [[1, 2], [3, 4]]


def test_either_byte_order_is_read() -> None:
    big = Image(height=1, width=2, encoding="16UC1", step=4, is_bigendian=1, data=b"\1\2\3\4")

    image = BRIDGE.imgmsg_to_cv2(big)

    assert image.tolist() == [[0x102, 0x304]]
    assert image.dtype.isnative
    assert BRIDGE.imgmsg_to_cv2(big, "8UC1").tolist() == [[1, 3]]


def test_an_image_without_conversion_shares_the_data() -> None:
    assert not BRIDGE.imgmsg_to_cv2(message(COLORED, "rgb8")).flags.writeable
    assert BRIDGE.imgmsg_to_cv2(message(COLORED, "rgb8"), "rgb8").flags.writeable


def test_an_array_becomes_a_message() -> None:
    header = Header(frame_id="camera")

    image = BRIDGE.cv2_to_imgmsg(COLORED[:, ::-1], "rgb8", header)

    assert (image.height, image.width, image.encoding, image.step) == (2, 2, "rgb8", 6)
    assert image.header is header
    assert image.data == COLORED[:, ::-1].tobytes()
    assert BRIDGE.cv2_to_imgmsg(COLORED.astype(">f4")).is_bigendian
    assert BRIDGE.cv2_to_imgmsg(COLORED).encoding == "8UC3"


@pytest.mark.parametrize("shape", [(0, 4), (4, 0), (0, 0, 3)])
def test_an_empty_image_goes_both_ways(shape: tuple[int, ...]) -> None:
    assert BRIDGE.imgmsg_to_cv2(BRIDGE.cv2_to_imgmsg(np.zeros(shape, np.uint8))).shape == shape


@pytest.mark.parametrize(("encoding", "desired", "text"), [
    ("8UC1", "bgr8", "[8UC1] is not a color format. but [bgr8] is. The conversion does not make sense"),
    ("8UC1", "8UC3", "[8UC1] and [8UC3] do not have the same number of channel"),
    ("mono8", "bayer_rggb8", "Unsupported conversion from [mono8] to [bayer_rggb8]"),
    ("mono8", "gray", "Unknown encoding gray"),
])  # fmt: skip
def test_incompatible_encodings_are_refused(encoding: str, desired: str, text: str) -> None:
    gray = np.zeros((4, 4), np.uint8)

    with pytest.raises(CvBridgeError) as caught:
        BRIDGE.imgmsg_to_cv2(message(gray, encoding), desired)
    assert str(caught.value) == text


SHORT = Image(height=2, width=2, encoding="rgb8", step=6, data=b"abc")
UNKNOWN = Image(height=2, width=2, encoding="RGB", step=6)


@pytest.mark.parametrize(("convert", "given", "kind", "text"), [
    (BRIDGE.imgmsg_to_cv2, [SHORT], CvBridgeError, r"buffer is too small .* must have 12 bytes, got 3"),
    (BRIDGE.imgmsg_to_cv2, [UNKNOWN], CvBridgeError, r"Unrecognized image encoding \[RGB\]"),
    (BRIDGE.cv2_to_imgmsg, [COLORED, "mono8"], CvBridgeError, "mono8, but image has incompatible type 8UC3"),
    (BRIDGE.cv2_to_imgmsg, [COLORED[0, 0]], CvBridgeError, r"or three dimensions, got the shape \(3,\)"),
    (BRIDGE.cv2_to_imgmsg, [COLORED.astype(np.int64)], KeyError, "got int64"),
    (BRIDGE.cv2_to_imgmsg, [[[1, 2]]], TypeError, "not a numpy array"),
    (cvtColor2, [COLORED[:, :, 0], "rgb8", "bgr8"], RuntimeError, r"\[rgb8\] must have 3 uint8 per pixel"),
    (cvtColor2, [np.zeros((2, 3, 2), np.uint8), "yuv422", "rgb8"], RuntimeError, "must have an even width"),
    (cvtColor2, [[1], "mono8", "rgb8"], RuntimeError, "two- or three-dimensional array, got a list"),
    (cvtColorForDisplay, [[1], "mono8", "bgr8"], RuntimeError, "or three-dimensional array, got a list"),
    (cvtColorForDisplay, [COLORED, "32SC1", "bgr8"], RuntimeError, r"\[32SC1\] must have 1 int32 per pixel"),
    (cvtColorForDisplay, [COLORED, "rgb8", "bgr8", True], RuntimeError, "than one channel is unsupported"),
])  # fmt: skip
def test_an_invalid_image_is_refused(
    convert: Any, given: list[Any], kind: type[Exception], text: str
) -> None:
    with pytest.raises(kind, match=text):
        convert(*given)


def test_depths_are_shown_between_black_and_white() -> None:
    depths = np.array([[1.0, 2.0, 3.0, np.nan]], np.float32)

    assert cvtColorForDisplay(depths, "32FC1", "mono8", True).tolist() == [[0, 128, 255, 0]]
    assert cvtColorForDisplay(depths, "32FC1", "mono8", False, 0.0, 10.0).tolist()[0][:3] == [26, 51, 76]
    assert cvtColorForDisplay(np.zeros((1, 1), np.uint8), "mono8", "", True).tolist() == [[[128] * 3]]
    labels = np.array([[0, 1, 146, -1]], np.int32)
    assert cvtColorForDisplay(labels, "32SC1", "").tolist()[0][1:] == [
        [214, 235, 249], [255, 248, 239], [0] * 3,
    ]  # fmt: skip
    same = cvtColorForDisplay(source=labels, encoding_in="32SC1", encoding_out="")
    assert same.tolist() == cvtColorForDisplay(labels, "32SC1", "").tolist()


@pytest.mark.parametrize(("name", "number"), [("mono8", 0), ("rgb8", 16), ("16UC1", 2), ("64FC4", 30)])
def test_encodings_have_the_numbers_of_opencv(name: str, number: int) -> None:
    assert getCvType(name) == number
    dtype, channels = BRIDGE.encoding_to_dtype_with_channels(name)
    assert BRIDGE.cvtype_to_name[number] == BRIDGE.dtype_with_channels_to_cvtype2(np.dtype(dtype), channels)


@pytest.mark.parametrize("name", ["", "8UC", "8UC0", "8UC-1", "8UC513", "mono8 ", "8UC٣", "8UC" + "9" * 5000])
def test_an_unknown_encoding_is_refused(name: str) -> None:
    with pytest.raises(RuntimeError, match="Unrecognized image encoding"):
        getCvType(name)


def test_image_encodings_have_the_properties_of_their_names() -> None:
    assert image_encodings.BAYER_GRBG16 == "bayer_grbg16"
    assert image_encodings.isColor("bgra8")
    assert not image_encodings.isColor("mono8")
    assert image_encodings.isMono("mono16")
    assert image_encodings.isBayer("bayer_rggb8")
    assert not image_encodings.isBayer("bayer_")
    assert image_encodings.hasAlpha("rgba16")
    assert (image_encodings.numChannels("32FC4"), image_encodings.bitDepth("yuv422")) == (4, 8)
    with pytest.raises(RuntimeError, match="Unknown encoding xyz"):
        image_encodings.numChannels("xyz")


class FakeOpenCV:
    """The functions of OpenCV that compressed images need."""

    IMREAD_UNCHANGED = -1
    error = RuntimeError

    decoded: Any = COLORED

    @classmethod
    def imdecode(cls, data: Any, flags: int) -> Any:
        return None if data.tobytes() == b"broken" else cls.decoded

    @staticmethod
    def imencode(ending: str, image: Any) -> tuple[bool, Any]:
        if ending == ".xyz":
            raise RuntimeError("no encoder")
        if ending == ".jp2":
            return False, ()
        return True, np.frombuffer(b"compressed", np.uint8)


def test_compressed_images_go_through_opencv(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", FakeOpenCV)

    packed = BRIDGE.cv2_to_compressed_imgmsg(COLORED, "png")

    assert (packed.format, packed.data) == ("png", b"compressed")
    assert BRIDGE.compressed_imgmsg_to_cv2(packed, "rgb8").tolist() == COLORED[:, :, ::-1].tolist()
    assert BRIDGE.compressed_imgmsg_to_cv2(CompressedImage(data=b"")) is None
    with pytest.raises(CvBridgeError, match=r"cannot read this compressed image \(6 bytes\)"):
        BRIDGE.compressed_imgmsg_to_cv2(CompressedImage(data=b"broken"), "bgr8")
    large = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 32_000, 32_000)
    with pytest.raises(CvBridgeError, match="at most 178956970 pixels, got 1024000000"):
        BRIDGE.compressed_imgmsg_to_cv2(CompressedImage(data=large))
    with pytest.raises(CvBridgeError, match="cannot write this image as 'xyz'"):
        BRIDGE.cv2_to_compressed_imgmsg(COLORED, "xyz")
    with pytest.raises(CvBridgeError, match=r"as 'jp2': OpenCV does not write uint8 with shape \(2, 2, 3\)"):
        BRIDGE.cv2_to_compressed_imgmsg(COLORED, "jp2")


GRAY = COLORED[:, :, 0]
CLEAR = np.dstack([COLORED, GRAY])


@pytest.mark.parametrize(
    ("decoded", "desired", "expected"),
    [
        (GRAY, "rgb8", np.dstack([GRAY] * 3)),
        (GRAY, "bgra8", np.dstack([GRAY, GRAY, GRAY, np.full_like(GRAY, 255)])), (GRAY, "mono8", GRAY),
        (GRAY, "mono16", GRAY * np.uint16(257)), (GRAY, "8UC1", GRAY),
        (GRAY, "32FC3", np.dstack([GRAY] * 3).astype(np.float32)), (GRAY[:, :, np.newaxis], "mono8", GRAY),
        (CLEAR, "bgr8", COLORED), (CLEAR, "rgba8", CLEAR[:, :, [2, 1, 0, 3]]), (CLEAR, "8UC3", COLORED),
        (CLEAR, "mono8", np.array(GRAY_OF_BGR, np.uint8)),
        (GRAY * np.uint16(257), "rgb8", np.dstack([GRAY * np.uint16(257)] * 3)),
        (COLORED * np.uint16(257), "bgr16", COLORED * np.uint16(257)),
        (COLORED * np.uint16(257), "bgr8", COLORED * np.uint16(257)),
        (GRAY * np.uint16(257), "32FC1", GRAY * np.float32(257)),
        (GRAY * np.uint16(257), "", GRAY * np.uint16(257)),
        (
            GRAY.astype(np.float32) / 255, "bgra8",
            np.dstack([GRAY / np.float32(255)] * 3 + [np.ones((2, 2), "f4")]),
        ),
    ],
)  # fmt: skip
def test_a_decoded_image_is_converted_from_its_own_channels(
    decoded: Any, desired: str, expected: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cv2", FakeOpenCV)
    monkeypatch.setattr(FakeOpenCV, "decoded", decoded)

    image = BRIDGE.compressed_imgmsg_to_cv2(CompressedImage(data=b"x"), desired)

    assert (image.dtype, image.shape) == (expected.dtype, expected.shape)
    assert np.array_equal(image, expected)
    assert not np.shares_memory(image, decoded)


def test_floats_become_gray_with_the_weights_of_opencv(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", FakeOpenCV)
    monkeypatch.setattr(FakeOpenCV, "decoded", COLORED.astype(np.float32))

    image = BRIDGE.compressed_imgmsg_to_cv2(CompressedImage(data=b"x"), "mono8")

    assert image.dtype == np.float32
    assert np.allclose(image, GRAY_OF_BGR, atol=0.5)


@pytest.mark.parametrize(("decoded", "desired", "text"), [
    (COLORED, "8UC1", "[bgr8] is a color format but [8UC1] is not"),
    (GRAY, "bayer_rggb8", "Unsupported conversion from [mono8] to [bayer_rggb8]"),
    (GRAY, "gray", "Unknown encoding gray"),
    (CLEAR[:, :, :2], "bgr8", "a decoded image must have 1, 3 or 4 channels, got an array of uint8"),
])  # fmt: skip
def test_a_decoded_image_is_not_converted_to_other_kinds(
    decoded: Any, desired: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cv2", FakeOpenCV)
    monkeypatch.setattr(FakeOpenCV, "decoded", decoded)

    with pytest.raises(CvBridgeError) as caught:
        BRIDGE.compressed_imgmsg_to_cv2(CompressedImage(data=b"x"), desired)
    assert str(caught.value).startswith(text)


def test_without_opencv_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)

    with pytest.raises(ImportError, match=r"a compressed image needs OpenCV.*pip install .*\[vision\]"):
        BRIDGE.compressed_imgmsg_to_cv2(CompressedImage(format="jpeg", data=b"x"))
    with pytest.raises(ImportError, match="compressing an image needs OpenCV"):
        BRIDGE.cv2_to_compressed_imgmsg(COLORED)


def test_without_numpy_the_error_names_the_extra() -> None:
    program = "import sys; sys.modules['numpy'] = None\nimport cv_bridge"

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)

    assert install_command("numpy") in ended.stderr


def test_opencv_is_not_imported_with_cv_bridge() -> None:
    program = "import sys, cv_bridge; print({'cv2', 'rospy'} & set(sys.modules))"

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)

    assert ended.stdout == "set()\n"
    assert cv_bridge.CvBridgeError.__mro__[1] is TypeError
