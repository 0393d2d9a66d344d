"""`CvBridge`, which converts between image messages and numpy arrays."""

from __future__ import annotations

import sys
from typing import Any

import sensor_msgs.msg  # noqa: F401 - star imports of the genuine module bind it
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from cv_bridge.boost.cv_bridge_boost import CV_MAT_CNWrap, CV_MAT_DEPTHWrap, cvtColor2, getCvType
from pipros_libraries.pictures.codecs import MAX_PIXELS
from pipros_libraries.pictures.encodings import CHANNEL_STEP, DTYPES
from pipros_libraries.pictures.headers import pixel_count
from pipros_libraries.vision.conversions import convert_decoded
from pipros_libraries.vision.extras import numpy as np
from pipros_libraries.vision.opencv import opencv


class CvBridgeError(TypeError):
    """An image cannot be converted."""


class CvBridge:
    """Converter between `sensor_msgs` image messages and numpy arrays in OpenCV's layout.

    Arrays have the shape (height, width), or (height, width, channels) for more than one channel. Only
    compressed images require OpenCV (`pip install 'pipros[vision]'`). A bridge has no state, so threads can
    share it.

    >>> bridge = CvBridge()
    >>> gray = bridge.imgmsg_to_cv2(bridge.cv2_to_imgmsg(np.zeros((4, 6, 3), np.uint8), "rgb8"), "mono8")
    >>> gray.shape
    (4, 6)
    """

    def __init__(self) -> None:
        self.cvtype_to_name = {
            number + CHANNEL_STEP * (channels - 1): f"{depth}C{channels}"
            for number, depth in enumerate(DTYPES)
            for channels in range(1, 5)
        }
        self.cvdepth_to_numpy_depth = dict(enumerate(DTYPES.values()))
        self.numpy_type_to_cvtype = {name: depth for depth, name in DTYPES.items()} | DTYPES

    def dtype_with_channels_to_cvtype2(self, dtype: Any, n_channels: int) -> str:
        """Return the encoding, such as 8UC3, for a numpy dtype and a number of channels.

        Raises:
            KeyError: no encoding uses this dtype.
        """
        if dtype.name not in self.numpy_type_to_cvtype:
            raise KeyError(f"dtype of an image must be one of {', '.join(DTYPES.values())}, got {dtype.name}")
        return f"{self.numpy_type_to_cvtype[dtype.name]}C{n_channels}"

    def cvtype2_to_dtype_with_channels(self, cvtype: int) -> tuple[str, int]:
        """Return the name of the numpy dtype and the number of channels of an OpenCV type."""
        return self.cvdepth_to_numpy_depth[CV_MAT_DEPTHWrap(cvtype)], CV_MAT_CNWrap(cvtype)

    def encoding_to_cvtype2(self, encoding: str) -> int:
        """Return the OpenCV type of an encoding.

        Raises:
            CvBridgeError: the encoding is unknown.
        """
        try:
            return getCvType(encoding)
        except RuntimeError as error:
            raise CvBridgeError(error) from None

    def encoding_to_dtype_with_channels(self, encoding: str) -> tuple[str, int]:
        """Return the name of the numpy dtype and the number of channels of an encoding.

        Raises:
            CvBridgeError: the encoding is unknown.
        """
        return self.cvtype2_to_dtype_with_channels(self.encoding_to_cvtype2(encoding))

    def imgmsg_to_cv2(self, img_msg: Any, desired_encoding: str = "passthrough") -> Any:
        """Convert a `sensor_msgs/Image` to an array. "passthrough" keeps the encoding of the message.

        Rows may be padded (`step`). If no conversion is needed, the array shares the message's data where
        possible; such an array is read-only.

        Raises:
            CvBridgeError: an encoding is unknown, the conversion is not supported, or the data is too short.
        """
        dtype_name, channels = self.encoding_to_dtype_with_channels(img_msg.encoding)
        dtype = np.dtype(dtype_name).newbyteorder(">" if img_msg.is_bigendian else "<")
        image = self._array(img_msg, dtype, channels)
        if not image.dtype.isnative:
            image = image.astype(image.dtype.newbyteorder("="))
        if desired_encoding == "passthrough":
            return image
        return self._converted(image, img_msg.encoding, desired_encoding)

    def cv2_to_imgmsg(self, cvim: Any, encoding: str = "passthrough", header: Header | None = None) -> Image:
        """Convert an array to a `sensor_msgs/Image`. "passthrough" uses the array's type, such as 8UC3.

        Raises:
            TypeError: `cvim` is not an array.
            KeyError: no encoding uses the array's dtype.
            CvBridgeError: the array does not have two or three dimensions, or the encoding is unknown or does
                not match the array's type.
        """
        if not isinstance(cvim, np.ndarray | np.generic):
            raise TypeError("Your input type is not a numpy array")
        if cvim.ndim not in (2, 3):
            raise CvBridgeError(f"an image must have two or three dimensions, got the shape {cvim.shape}")
        shape: tuple[int, ...] = cvim.shape
        height, width, channels = *shape[:2], (*shape, 1)[2]
        cv_type = self.dtype_with_channels_to_cvtype2(cvim.dtype, channels)
        if encoding != "passthrough" and self._type_name(encoding) != cv_type:
            raise CvBridgeError(
                f"encoding specified as {encoding}, but image has incompatible type {cv_type}"
            )
        message = Image(
            height=height,
            width=width,
            encoding=cv_type if encoding == "passthrough" else encoding,
            is_bigendian=int(cvim.dtype.isnative == (sys.byteorder == "big")),
            data=cvim.tobytes(),
        )
        message.header = header or message.header
        message.step = len(message.data) // max(height, 1)
        return message

    def compressed_imgmsg_to_cv2(self, cmprs_img_msg: Any, desired_encoding: str = "passthrough") -> Any:
        """Decode a `sensor_msgs/CompressedImage` with OpenCV.

        For "passthrough", channels are in the order blue, green, red, and the result is None if OpenCV cannot
        decode the image. Other encodings convert the channels that the image really has. Values that are not
        uint8 keep their type if the encoding defines colours, such as bgr8.

        Raises:
            CvBridgeError: the image has too many pixels, cannot be decoded, or cannot be converted.
            ImportError: OpenCV is not installed.
        """
        cv2 = opencv("a compressed image")
        data = np.frombuffer(cmprs_img_msg.data, np.uint8).reshape(1, -1)
        if (pixels := pixel_count(data.tobytes()) or 0) > MAX_PIXELS:  # 100 kB could fill 2 GB
            raise CvBridgeError(f"a compressed image must have at most {MAX_PIXELS} pixels, got {pixels}")
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
        if desired_encoding == "passthrough":
            return image
        if image is None:
            raise CvBridgeError(f"OpenCV cannot read this compressed image ({data.size} bytes)")
        try:
            return convert_decoded(image, desired_encoding)
        except RuntimeError as error:
            raise CvBridgeError(error) from None

    def cv2_to_compressed_imgmsg(self, cvim: Any, dst_format: str = "jpg") -> CompressedImage:
        """Encode an array as a `sensor_msgs/CompressedImage`.

        Args:
            cvim: the image; channels are in the order blue, green, red.
            dst_format: a file extension that OpenCV supports, without the dot.

        Raises:
            TypeError: `cvim` is not an array.
            CvBridgeError: OpenCV cannot encode the image in `dst_format`.
            ImportError: OpenCV is not installed.
        """
        if not isinstance(cvim, np.ndarray | np.generic):
            raise TypeError("Your input type is not a numpy array")
        cv2 = opencv("compressing an image")
        try:
            is_encoded, data = cv2.imencode(f".{dst_format}", cvim)
        except cv2.error as error:
            raise CvBridgeError(f"OpenCV cannot write this image as {dst_format!r}: {error}") from error
        if not is_encoded:
            raise CvBridgeError(
                f"cannot write this image as {dst_format!r}: OpenCV does not write {cvim.dtype} with shape "
                f"{cvim.shape} in this format"
            )
        return CompressedImage(format=dst_format, data=data.tobytes())

    def _array(self, img_msg: Any, dtype: Any, channels: int) -> Any:
        row = img_msg.width * channels * dtype.itemsize
        # Some publishers do not set `step`; their rows are not padded.
        step = max(img_msg.step, row)
        shape = (img_msg.height, img_msg.width, channels)[: 2 if channels == 1 else 3]
        strides = (step, dtype.itemsize * channels, dtype.itemsize)[: len(shape)]
        data = img_msg.data.encode() if isinstance(img_msg.data, str) else bytes(img_msg.data)
        needed = step * (img_msg.height - 1) + row if img_msg.height else 0
        if len(data) < needed:
            raise CvBridgeError(
                f"buffer is too small for requested array: {img_msg.width} x {img_msg.height} pixels of "
                f"[{img_msg.encoding}] with a step of {step} must have {needed} bytes, got {len(data)}"
            )
        return np.ascontiguousarray(np.ndarray(shape, dtype, data, strides=strides))

    def _converted(self, image: Any, encoding: str, desired: str) -> Any:
        try:
            return cvtColor2(image, encoding, desired)
        except RuntimeError as error:
            raise CvBridgeError(error) from None

    def _type_name(self, encoding: str) -> str:
        cv_type = self.encoding_to_cvtype2(encoding)
        return (
            self.numpy_type_to_cvtype[self.cvdepth_to_numpy_depth[cv_type % CHANNEL_STEP]]
            + f"C{CV_MAT_CNWrap(cv_type)}"
        )
