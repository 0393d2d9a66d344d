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
for ending in ("jpg", "jpeg", "png", "bmp", "tiff"):
    for shape in ((6, 8), (6, 8, 3)):
        image = rng.randint(0, 256, shape).astype("uint8")
        message = bridge.cv2_to_compressed_imgmsg(image, ending)
        data = bytes(message.data)
        found[f"{ending} {shape}"] = [message.format, hashlib.sha1(data).hexdigest()]  # noqa: S324
        for encoding in ("passthrough", "bgr8", "rgb8", "mono8"):
            if encoding == "passthrough" or len(shape) == 3:
                arguments = CompressedImage(format=ending, data=data), encoding
                found[f"{ending} {shape} {encoding}"] = asked(bridge.compressed_imgmsg_to_cv2, *arguments)
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
