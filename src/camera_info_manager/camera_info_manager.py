"""CameraInfoManager: what a driver of a camera needs to publish its CameraInfo."""

from __future__ import annotations

import os
import re

from sensor_msgs.msg import CameraInfo
from sensor_msgs.srv import SetCameraInfo, SetCameraInfoRequest, SetCameraInfoResponse

import rospy
from camera_calibration_parsers import calibration as calibration_of
from camera_calibration_parsers import camera_info as camera_info_of
from pipros.vision.calibration import CalibrationError
from pipros.vision.calibration_files import FILE, PACKAGE, load, resolved, save

default_camera_info_url = "file://${ROS_HOME}/camera_info/${NAME}.yaml"

# What parseURL returns; what is at least URL_invalid names no file.
URL_empty = 0
URL_file = 1
URL_package = 2
URL_invalid = 3

_NAME = re.compile(r"[A-Za-z0-9_]+")


class CameraInfoError(Exception):
    """Something is wrong with a calibration."""


class CameraInfoMissingError(CameraInfoError):
    """The calibration was not loaded yet."""


class CameraInfoManager:
    """Loads and saves the calibration of a camera, and offers the service `set_camera_info`.

    The calibration is in the file that a URL names: `file:///path`, `package://package/path`, or the default,
    `file://${ROS_HOME}/camera_info/${NAME}.yaml`. `${NAME}` is the name of the camera. Call `loadCameraInfo`
    before the first `getCameraInfo`, and after a change of name or URL.

    Args:
        cname: the name of the camera, of letters, digits and underscores.
        url: where the calibration is; empty for the default.
        namespace: of the service; empty for the node's own.
    """

    def __init__(self, cname: str = "camera", url: str = "", namespace: str = "") -> None:
        self.cname = cname
        self.url = url
        self.camera_info: CameraInfo | None = None
        name = f"{namespace}/set_camera_info" if namespace else "set_camera_info"
        rospy.logdebug(f"{name} service declared")
        self.svc = rospy.Service(name, SetCameraInfo, self.setCameraInfo)

    def getCameraInfo(self) -> CameraInfo:
        """The calibration; all zeros where the file does not exist or cannot be read.

        Raises:
            CameraInfoMissingError: it was not loaded.
        """
        if self.camera_info is None:
            raise CameraInfoMissingError("Calibration missing, loadCameraInfo() needed.")
        return self.camera_info

    def getCameraName(self) -> str:
        """The name of the camera."""
        return self.cname

    def getURL(self) -> str:
        """The URL as it was given."""
        return self.url

    def isCalibrated(self) -> bool:
        """Whether the camera has a calibration.

        Raises:
            CameraInfoMissingError: it was not loaded.
        """
        return bool(self.getCameraInfo().K[0] != 0.0)

    def loadCameraInfo(self) -> None:
        """Load the calibration. What is wrong with it is logged, and it is all zeros then."""
        self._loadCalibration(self.url, self.cname)

    def setCameraInfo(self, req: SetCameraInfoRequest) -> SetCameraInfoResponse:
        """The service: take a calibration and save it."""
        rospy.loginfo("New camera info received")
        self.camera_info = req.camera_info
        is_saved = saveCalibration(req.camera_info, self.url, self.cname)
        return SetCameraInfoResponse(is_saved, "" if is_saved else "Error storing camera calibration.")

    def setCameraName(self, cname: str) -> bool:
        """Change the name of the camera; its calibration must be loaded then.

        Returns False, and changes nothing, if it has other characters than letters, digits and underscores.
        """
        if not _NAME.fullmatch(cname):
            return False
        self.cname = cname
        self.camera_info = None
        return True

    def setURL(self, url: str) -> bool:
        """Change where the calibration is; it must be loaded then.

        Returns False, and changes nothing, if it is not a URL for a calibration.
        """
        if parseURL(resolveURL(url, self.cname)) >= URL_invalid:
            return False
        self.url = url
        self.camera_info = None
        return True

    def _loadCalibration(self, url: str, cname: str) -> None:
        path = _path(url, cname)
        self.camera_info = CameraInfo() if path is None else loadCalibrationFile(path, cname)


def genCameraName(from_string: str) -> str:
    """A name for a camera, of a text such as a device's model and number: other characters become `_`."""
    return re.sub(r"[^A-Za-z0-9_]", "_", from_string)


def resolveURL(url: str, cname: str) -> str:
    """A URL with ${NAME} and ${ROS_HOME} replaced; other variables stay, and are logged."""
    found, unknown = resolved(url, cname, os.environ)
    for name in unknown:
        rospy.logwarn(f"[{cname}] invalid URL substitution (not resolved): ${{{name}}} in {url}")
    return found


def parseURL(url: str) -> int:
    """What kind of URL it is, after `resolveURL`: URL_empty, URL_file, URL_package or URL_invalid."""
    if not url:
        return URL_empty
    if url[: len(FILE) + 1].lower() == f"{FILE}/":
        return URL_file
    package, slash, path = url[len(PACKAGE) :].partition("/")
    if url[: len(PACKAGE)].lower() == PACKAGE and package and slash and path:
        return URL_package
    return URL_invalid


def getPackageFileName(url: str) -> str:
    """The file of a package:// URL; empty where the package does not exist, which is logged."""
    import rospkg

    package, _, path = url[len(PACKAGE) :].partition("/")
    try:
        return f"{rospkg.RosPack().get_path(package)}/{path}"
    except rospkg.ResourceNotFound:
        rospy.logwarn(f"unknown package: {package} (ignored)")
        return ""


def loadCalibrationFile(filename: str, cname: str) -> CameraInfo:
    """The calibration in a file that ends with .yaml, .yml or .ini.

    Where the file does not exist, or cannot be read, which is logged, it is all zeros.
    """
    try:
        found = load(filename)
    except FileNotFoundError:
        rospy.logdebug(f"[{cname}] is not calibrated: {filename} does not exist")
        return CameraInfo()
    except (OSError, CalibrationError) as error:
        rospy.logwarn(f"[{cname}] camera calibration file ignored: {error}")
        return CameraInfo()
    if found.name != cname:
        rospy.logwarn(f"[{cname}] does not match name {found.name} in file {filename}")
    return camera_info_of(found)


def saveCalibration(new_info: CameraInfo, url: str, cname: str) -> bool:
    """Save a calibration where the URL says. Returns False, and logs why, where that is not possible."""
    path = _path(url, cname)
    return path is not None and saveCalibrationFile(new_info, path, cname)


def saveCalibrationFile(ci: CameraInfo, filename: str, cname: str) -> bool:
    """Save a calibration in a file; its folders are made. Returns False, and logs why, where it cannot be."""
    try:
        save(filename, calibration_of(cname, ci))
    except (OSError, CalibrationError) as error:
        rospy.logerr(f"[{cname}] file [{filename}] not saved: {error}")
        return False
    rospy.loginfo(f"writing calibration data to {filename}")
    return True


def _path(url: str, cname: str) -> str | None:
    """The file that a URL names; None, which is logged, where it names none."""
    found = resolveURL(url, cname)
    kind = parseURL(found)
    if kind == URL_empty:
        return _path(default_camera_info_url, cname)
    if kind == URL_file:
        return found[len(FILE) :]
    path = getPackageFileName(found) if kind == URL_package else ""
    if not path:
        rospy.logerr(f"invalid URL: {found} (ignored)")
    return path or None
