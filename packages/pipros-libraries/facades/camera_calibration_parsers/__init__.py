"""Drop-in replacement for Noetic's camera_calibration_parsers: camera calibration files."""

from __future__ import annotations

import sys

from sensor_msgs.msg import CameraInfo

from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.vision.calibration import Calibration, CalibrationError
from pipros_libraries.vision.calibration_files import load, save

_star_names(
    __name__,
    hidden="Calibration CalibrationError calibration camera_info load save sys writeCalibration",
)


def readCalibration(file_name: str) -> tuple[str, CameraInfo] | None:
    """Read the camera name and the CameraInfo from a .yaml, .yml or .ini file.

    If the file cannot be read, print the reason to standard error and return None.
    """
    try:
        found = load(file_name)
    except (OSError, CalibrationError) as error:
        print(f"Failed to load a camera calibration: {error}", file=sys.stderr)
        return None
    return found.name, camera_info(found)


def writeCalibration(file_name: str, camera_name: str, cam_info: CameraInfo) -> bool:
    """Write a calibration to a .yaml, .yml or .ini file. Noetic has this function only in C++.

    If the file cannot be written, print the reason to standard error and return False.
    """
    try:
        save(file_name, calibration(camera_name, cam_info))
    except (OSError, CalibrationError) as error:
        print(f"Failed to save a camera calibration to {file_name}: {error}", file=sys.stderr)
        return False
    return True


def camera_info(calibration: Calibration) -> CameraInfo:
    """Convert a calibration to a message."""
    return CameraInfo(
        width=calibration.width,
        height=calibration.height,
        distortion_model=calibration.model,
        D=calibration.d,
        K=calibration.k,
        R=calibration.r,
        P=calibration.p,
    )


def calibration(camera_name: str, cam_info: CameraInfo) -> Calibration:
    """Convert a message to a calibration."""
    d, k, r, p = (tuple(map(float, values)) for values in (cam_info.D, cam_info.K, cam_info.R, cam_info.P))
    return Calibration(camera_name, cam_info.width, cam_info.height, cam_info.distortion_model, d, k, r, p)
