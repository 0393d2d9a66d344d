"""Print compressed and rectified images of either side, with Debian's OpenCV."""

from __future__ import annotations

import hashlib
import json
import sys

import numpy as np
from sensor_msgs.msg import CameraInfo, CompressedImage

from cv_bridge import CvBridge
from image_geometry import PinholeCameraModel

rng = np.random.RandomState(int(sys.argv[1]))
bridge = CvBridge()


def asked(function, *arguments):
    try:
        found = function(*arguments)
    except TypeError as error:
        return type(error).__name__
    return None if found is None else [list(found.shape), hashlib.sha1(found.tobytes()).hexdigest()]  # noqa: S324


found = {}
PICTURES = [
    *(
        (ending, (6, 8, *rest), "uint8")
        for ending in ("jpg", "jpeg", "png", "bmp", "tiff")
        for rest in ((), (3,))
    ),
    *((ending, (6, 8, 4), "uint8") for ending in ("png", "bmp", "tiff")),
    *((ending, (6, 8, *rest), "uint16") for ending in ("png", "tiff") for rest in ((), (3,), (4,))),
]
# The encodings with which genuine cv_bridge is right, by dimensions or channels: it takes all for bgr8.
RIGHT = {
    2: ("rgb8", "bgra8", "rgba8"),
    3: ("bgr8", "rgb8", "bgra8", "rgba8", "mono8", "8UC3", "32FC3"),
    4: ("rgb8", "bgra8", "rgba8", "mono8"),
}
for ending, shape, dtype in PICTURES:
    image = rng.randint(0, np.iinfo(dtype).max + 1, shape).astype(dtype)
    name = f"{ending} {shape} {dtype}"
    message = bridge.cv2_to_compressed_imgmsg(image, ending)
    data = bytes(message.data)
    found[name] = [message.format, hashlib.sha1(data).hexdigest()]  # noqa: S324
    picture = CompressedImage(format=ending, data=data)
    decoded = bridge.compressed_imgmsg_to_cv2(picture)
    for encoding in ("passthrough", *RIGHT[(*decoded.shape, 2)[2]]):
        found[f"{name} {encoding}"] = asked(bridge.compressed_imgmsg_to_cv2, picture, encoding)
found["broken"] = asked(bridge.compressed_imgmsg_to_cv2, CompressedImage(data=b"broken"))
raw = rng.randint(0, 256, (60, 80, 3)).astype("uint8")
for coefficients in ([], [-0.3, 0.1, 0.01, 0.01, 0.0]):
    model, rectified = PinholeCameraModel(), np.zeros_like(raw)
    info = CameraInfo(width=80, height=60, D=coefficients)
    info.K, info.R = [70.0, 0, 40, 0, 70, 30, 0, 0, 1], [1.0, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [70.0, 0, 41, 0, 0, 70, 29, 0, 0, 0, 1, 0]
    model.fromCameraInfo(info)
    model.rectifyImage(raw, rectified)
    found[f"rectified {coefficients}"] = hashlib.sha1(rectified.tobytes()).hexdigest()  # noqa: S324
print(json.dumps(found))
