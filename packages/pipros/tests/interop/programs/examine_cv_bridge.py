"""Print the results of cv_bridge of either side for random images: digests, and types and texts of errors."""

from __future__ import annotations

import hashlib
import itertools
import json
import sys

import numpy as np
from sensor_msgs.msg import Image

from cv_bridge import CvBridge, CvBridgeError, cvtColorForDisplay, getCvType
from cv_bridge.boost.cv_bridge_boost import cvtColor2

COLORS = [f"{name}{bits}" for bits in (8, 16) for name in ("rgb", "rgba", "bgr", "bgra", "mono")]
COLORS += [f"bayer_{order}{bits}" for bits in (8, 16) for order in ("rggb", "bggr", "gbrg", "grbg")]
TYPES = [f"{depth}C{n}" for depth in ("8U", "8S", "16U", "16S", "32S", "32F", "64F") for n in (1, 2, 3, 4)]
ENCODINGS = [*COLORS, "yuv422", *TYPES]
ODD = ["8UC5", "8U", "32FC", "xyz", "", "64FC10", "8uc1", "8UC", "32SC4 ", "64F", "32U", "8UC-1", "8UC3x"]

rng = np.random.RandomState(int(sys.argv[1]))
bridge = CvBridge()


def described(image):
    if not isinstance(image, np.ndarray):
        return repr(image)
    digest = hashlib.sha1(np.ascontiguousarray(image).tobytes()).hexdigest()  # noqa: S324
    return [str(image.dtype), list(image.shape), digest]


def asked(function, *arguments):
    try:
        return described(function(*arguments))
    except (RuntimeError, TypeError, KeyError) as error:
        text = str(error)
        kind = "RuntimeError" if isinstance(error, RuntimeError) else type(error).__name__
        return [kind, "refused by OpenCV" if "OpenCV(" in text else text]


def random_array(encoding, height, width):
    dtype, channels = bridge.encoding_to_dtype_with_channels(encoding)
    shape = (height, width) if channels == 1 else (height, width, channels)
    if np.dtype(dtype).kind == "f":
        values = rng.choice([1.0, 100.0, 1e5, 1e12], shape) * rng.standard_normal(shape)
        halves = np.rint(values) + 0.5
        values = np.where(rng.random_sample(shape) < 0.2, halves, values)
        for special in (np.nan, np.inf, -np.inf):
            values[rng.random_sample(shape) < 0.02] = special
        return values.astype(dtype)
    limits = np.iinfo(dtype)
    return rng.randint(limits.min, int(limits.max) + 1, shape, dtype=dtype)


def message_of(encoding, image, big):
    image = image.astype(image.dtype.newbyteorder(">" if big else "<"))
    data = image.tobytes()
    return Image(
        height=image.shape[0],
        width=image.shape[1],
        encoding=encoding,
        is_bigendian=big,
        step=len(data) // max(1, image.shape[0]),
        data=data,
    )


found = {}
for name in [*ENCODINGS, *ODD]:
    found[f"type {name}"] = asked(getCvType, name), asked(bridge.encoding_to_dtype_with_channels, name)

for source, target in itertools.product(ENCODINGS, ["", *ENCODINGS, "xyz"]):
    # OpenCV's gray values of a Bayer pattern depend on the width: it rounds only narrow images.
    widest = 9 if source.startswith("bayer") and target.startswith("mono") else 40
    height, width = int(rng.randint(3, 20)), 2 * int(rng.randint(2, widest))
    image = random_array(source, height, width)
    found[f"{source} to {target}"] = asked(cvtColor2, image, source, target)
    message = message_of(source, image, bool(rng.randint(2)))
    found[f"message {source} to {target}"] = asked(bridge.imgmsg_to_cv2, message, target)

for source in COLORS:
    for height, width in ((1, 2), (2, 2), (3, 2), (1, 4), (2, 6), (480, 640)):
        image = random_array(source, height, width)
        found[f"{source} {height} {width}"] = asked(cvtColor2, image, source, "bgr8")
        if not (source.startswith("bayer") and width > 18):
            found[f"gray {source} {height} {width}"] = asked(cvtColor2, image, source, "mono8")

for source in [*ENCODINGS, "xyz"]:
    height, width = int(rng.randint(3, 9)), 2 * int(rng.randint(2, 9))
    image = random_array("8UC1" if source == "xyz" else source, height, width)
    found[f"passthrough {source}"] = asked(bridge.imgmsg_to_cv2, message_of(source, image, False))
    message = bridge.cv2_to_imgmsg(image)
    found[f"to message {source}"] = [
        message.encoding, message.step, bool(message.is_bigendian), len(message.data),
    ]  # fmt: skip
    for other in ("bgr8", "mono16", "32FC1", "xyz"):
        try:
            found[f"to message {source} as {other}"] = bridge.cv2_to_imgmsg(image, other).encoding
        except CvBridgeError as error:
            found[f"to message {source} as {other}"] = str(error)
    if np.isfinite(image).all():
        if source == "32SC1":  # differences of more than 31 bits cannot be images
            image = image // 1000
        for target, scaling in itertools.product(
            ("", "mono8", "bgr8", "rgba8", "mono16", "xyz"), (False, True)
        ):
            found[f"display {source} {target} {scaling}"] = asked(
                cvtColorForDisplay, image, source, target, scaling
            )
        for target in ("", "mono8"):
            limits = sorted(rng.randint(0, 300, 2).tolist())
            found[f"display {source} {target} limits"] = asked(
                cvtColorForDisplay, image, source, target, False, *map(float, limits)
            )
found["labels"] = asked(cvtColorForDisplay, np.arange(-300, 300, dtype="int32").reshape(20, 30), "32SC1", "")
found["no array"] = asked(bridge.cv2_to_imgmsg, [1, 2])
found["constants"] = [
    {str(number): name for number, name in sorted(bridge.cvtype_to_name.items())},
    {str(number): name for number, name in sorted(bridge.cvdepth_to_numpy_depth.items())},
    bridge.numpy_type_to_cvtype,
]
print(json.dumps(found))
