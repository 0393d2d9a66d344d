"""Compress images with Debian's OpenCV and pipros' modules, and print both forms."""

import base64
import json

import cv2
import numpy as np

from pipros_libraries.pictures.codecs import OpenCVCodec
from pipros_libraries.vision.compressed_images import CompressionSettings, compressed, decompressed

codec = OpenCVCodec(cv2)
rng = np.random.RandomState(1)
found = {}
for encoding, shape, dtype in (
    ("rgb8", (6, 8, 3), "uint8"), ("bgra8", (6, 8, 4), "uint8"), ("mono8", (6, 8), "uint8"),
    ("mono16", (6, 8), "uint16"), ("rgb16", (6, 8, 3), "uint16"), ("bayer_gbrg8", (6, 8), "uint8"),
):  # fmt: skip
    image = rng.randint(0, 256, shape).astype(dtype)
    for settings in (CompressionSettings("png"), CompressionSettings("jpeg")):
        kind, data = compressed(image, encoding, settings, codec)
        back, name = decompressed(kind, data, codec)
        assert (name, back.shape, back.dtype) == (encoding, image.shape, image.dtype), kind
        if settings.kind == "png" and encoding != "bgra8":
            assert np.array_equal(back, image), kind
        if encoding != "rgb16":  # Pillow does not support 16-bit colours
            found[f"{kind} {encoding}"] = [kind, base64.b64encode(data).decode(), back.tolist()]
print(json.dumps(found))
