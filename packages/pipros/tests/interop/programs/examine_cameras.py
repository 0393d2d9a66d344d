"""Print the results of image_geometry of either side for random cameras and points."""

from __future__ import annotations

import json
import sys
import warnings

import numpy as np
from sensor_msgs.msg import CameraInfo

from image_geometry import PinholeCameraModel, StereoCameraModel

warnings.simplefilter("ignore")
rng = np.random.RandomState(int(sys.argv[1]))
# Coefficients of real lenses, with each count that OpenCV supports.
SCALES = [0.3, 0.1, 0.01, 0.01, 0.05, 0.3, 0.1, 0.05, 0.01, 0.01, 0.01, 0.01, 0.05, 0.05]
GETTERS = (
    "fullResolution intrinsicMatrix distortionCoeffs rotationMatrix projectionMatrix fullIntrinsicMatrix "
)
GETTERS += "fullProjectionMatrix cx cy fx fy Tx Ty fovX fovY tfFrame"


def plain(value):
    if isinstance(value, np.ndarray):
        return [type(value).__name__, *np.asarray(value).tolist()]
    if isinstance(value, tuple):
        return [plain(part) for part in value]
    return float(value) if isinstance(value, (np.floating, float)) else value


def asked(function, *arguments):
    try:
        return plain(function(*arguments))
    except Exception as error:  # OpenCV has its own exception
        return "refused" if type(error).__name__ in ("error", "ValueError") else repr(error)


def turn():
    angle = rng.uniform(-0.2, 0.2)
    axis = rng.standard_normal(3)
    x, y, z = axis / np.linalg.norm(axis) * np.sin(angle / 2)
    w = np.cos(angle / 2)
    return [
        *(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        *(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        *(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    ]


def camera(number):
    width, height = int(rng.randint(2, 2000)), int(rng.randint(2, 2000))
    fx, fy = (0.0, 0.0) if number % 10 == 9 else rng.uniform(50, 2000, 2)
    cx, cy = rng.uniform(0, width), rng.uniform(0, height)
    info = CameraInfo(width=width, height=height, distortion_model="plumb_bob")
    info.header.frame_id = f"camera{number}"
    count = [0, 4, 5, 8, 12, 14, 3, 5][number % 8]
    info.D = (rng.standard_normal(count) * SCALES[:count]).tolist()
    info.K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
    info.R = turn()
    info.P = [fx * 0.9, 0, cx + 1, -fx * rng.uniform(0, 0.3), 0, fy * 0.9, cy - 1, 0, 0, 0, 1, 0]
    if number % 3 == 0:
        info.binning_x, info.binning_y = (int(value) for value in rng.randint(0, 4, 2))
    if number % 4 == 0:
        info.roi.x_offset, info.roi.y_offset = (int(value) for value in rng.randint(0, 20, 2))
        info.roi.width, info.roi.height = width // 2, height // 2
    return info


found = {}
for number in range(120):
    info, other = camera(number), camera(number)
    model, pair = PinholeCameraModel(), StereoCameraModel()
    model.fromCameraInfo(info)
    pair.fromCameraInfo(info, other)
    found[f"{number} is"] = [asked(getattr(model, name)) for name in GETTERS.split()]
    found[f"{number} part"] = [
        *(model.binning_x, model.binning_y, model.width, model.height, info.roi.width),
        *(model.raw_roi.x_offset, model.raw_roi.y_offset, model.raw_roi.width, model.raw_roi.height),
    ]
    found[f"{number} pair"] = [pair.tfFrame(), plain(pair.Q)]
    for turn_of in range(5):
        point = rng.uniform(-5, 5, 3).tolist()
        if turn_of == 4:
            point[2] = 0.0
        pixel = rng.uniform(0, 1000, 2).tolist()
        away, depth = rng.uniform(-9, 9, 2).tolist() if turn_of else [0.0, 0.0]
        found[f"{number} {turn_of}"] = [
            asked(model.project3dToPixel, point), asked(model.projectPixelTo3dRay, pixel),
            asked(pair.project3dToPixel, point), asked(pair.projectPixelTo3d, pixel, away),
            asked(pair.getZ, away), asked(pair.getDisparity, depth),
            *(asked(getattr(model, f"getDelta{name}"), away, depth) for name in "UVXY"),
        ]  # fmt: skip
        found[f"{number} rectified {turn_of}"] = asked(model.rectifyPoint, pixel)
print(json.dumps(found))
