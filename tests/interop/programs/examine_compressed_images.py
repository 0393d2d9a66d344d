"""Asks cv_bridge of either side, with Debian's OpenCV, about compressed images."""

from __future__ import annotations

import hashlib
import json
import sys

import numpy as np
from sensor_msgs.msg import CompressedImage

from cv_bridge import CvBridge

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
print(json.dumps(found))
