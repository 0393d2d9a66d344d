"""`CameraInfoManager`, which provides a camera driver with its CameraInfo."""

from __future__ import annotations

import os
import re

from sensor_msgs.msg import CameraInfo
from sensor_msgs.srv import SetCameraInfo, SetCameraInfoRequest, SetCameraInfoResponse

import rospy
from camera_calibration_parsers import calibration as calibration_of
from camera_calibration_parsers import camera_info as camera_info_of
from pipros.basics.windows import path_of_url
from pipros_libraries.vision.calibration import CalibrationError
from pipros_libraries.vision.calibration_files import FILE, PACKAGE, load, resolved, save

default_camera_info_url = "file://${ROS_HOME}/camera_info/${NAME}.yaml"

# Results of parseURL. Values >= URL_invalid mean that the URL cannot be used.
URL_empty = 0
URL_file = 1
URL_package = 2
URL_invalid = 3

_NAME = re.compile(r"[A-Za-z0-9_]+")


class CameraInfoError(Exception):
    """Base class of calibration errors."""


class CameraInfoMissingError(CameraInfoError):
    """The calibration has not been loaded yet."""


class CameraInfoManager:
    """The calibration of a camera. The service `set_camera_info` changes and saves it.

    The calibration file is given by a URL: `file:///path`, `package://package/path`, or the default,
    `file://${ROS_HOME}/camera_info/${NAME}.yaml`, where `${NAME}` is the camera name. Call `loadCameraInfo`
    before the first `getCameraInfo`, and after changing the name or the URL.

    Args:
        cname: camera name; may contain ASCII letters, digits and underscores.
        url: URL of the calibration file; empty for the default.
        namespace: namespace of the service; empty for the node's namespace.
    """

    def __init__(self, cname: str = "camera", url: str = "", namespace: str = "") -> None:
        self.cname = cname
        self.url = url
        self.camera_info: CameraInfo | None = None
        name = f"{namespace}/set_camera_info" if namespace else "set_camera_info"
        rospy.logdebug(f"{name} service declared")
        self.svc = rospy.Service(name, SetCameraInfo, self.setCameraInfo)

    def getCameraInfo(self) -> CameraInfo:
        """Return the calibration. All values are zero if `loadCameraInfo` failed.

        Raises:
            CameraInfoMissingError: there is no calibration; call `loadCameraInfo` first.
        """
        if self.camera_info is None:
            raise CameraInfoMissingError("Calibration missing, loadCameraInfo() needed.")
        return self.camera_info

    def getCameraName(self) -> str:
        """Return the camera name."""
        return self.cname

    def getURL(self) -> str:
        """Return the URL as passed, without substitution."""
        return self.url

    def isCalibrated(self) -> bool:
        """Return whether the camera is calibrated.

        Raises:
            CameraInfoMissingError: there is no calibration; call `loadCameraInfo` first.
        """
        return bool(self.getCameraInfo().K[0] != 0.0)

    def loadCameraInfo(self) -> None:
        """Load the calibration. On failure, log the reason and set all values to zero."""
        self._loadCalibration(self.url, self.cname)

    def setCameraInfo(self, req: SetCameraInfoRequest) -> SetCameraInfoResponse:
        """Handle a service request to use and save a new calibration."""
        rospy.loginfo("New camera info received")
        self.camera_info = req.camera_info
        is_saved = saveCalibration(req.camera_info, self.url, self.cname)
        return SetCameraInfoResponse(is_saved, "" if is_saved else "Error storing camera calibration.")

    def setCameraName(self, cname: str) -> bool:
        """Change the camera name. The calibration must be loaded again afterwards.

        Return False without a change if `cname` is empty or contains characters other than ASCII letters,
        digits and underscores.
        """
        if not _NAME.fullmatch(cname):
            return False
        self.cname = cname
        self.camera_info = None
        return True

    def setURL(self, url: str) -> bool:
        """Change the URL of the calibration file. The calibration must be loaded again afterwards.

        Return False without a change if the URL is invalid.
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
    """Return a valid camera name: underscores replace all characters except ASCII letters and digits."""
    return re.sub(r"[^A-Za-z0-9_]", "_", from_string)


def resolveURL(url: str, cname: str) -> str:
    """Substitute ${NAME} and ${ROS_HOME} in a URL. Other variables are kept, with a warning."""
    found, unknown = resolved(url, cname, os.environ)
    for name in unknown:
        rospy.logwarn(f"[{cname}] invalid URL substitution (not resolved): ${{{name}}} in {url}")
    return found


def parseURL(url: str) -> int:
    """Return the kind of a resolved URL: URL_empty, URL_file, URL_package or URL_invalid."""
    if not url:
        return URL_empty
    if url[: len(FILE) + 1].lower() == f"{FILE}/":
        return URL_file
    package, slash, path = url[len(PACKAGE) :].partition("/")
    if url[: len(PACKAGE)].lower() == PACKAGE and package and slash and path:
        return URL_package
    return URL_invalid


def getPackageFileName(url: str) -> str:
    """Return the path for a package:// URL.

    If the package is unknown, log a warning and return an empty string.
    """
    import rospkg

    package, _, path = url[len(PACKAGE) :].partition("/")
    try:
        return f"{rospkg.RosPack().get_path(package)}/{path}"
    except rospkg.ResourceNotFound:
        rospy.logwarn(f"unknown package: {package} (ignored)")
        return ""


def loadCalibrationFile(filename: str, cname: str) -> CameraInfo:
    """Read the calibration from a .yaml, .yml or .ini file.

    If the file does not exist or cannot be read, all values of the result are zero. A file that cannot be
    read causes a warning.
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
    """Save a calibration to the file at a URL. On failure, log the reason and return False."""
    path = _path(url, cname)
    return path is not None and saveCalibrationFile(new_info, path, cname)


def saveCalibrationFile(ci: CameraInfo, filename: str, cname: str) -> bool:
    """Save a calibration to a file, creating missing folders. On failure, log the reason and return False."""
    try:
        save(filename, calibration_of(cname, ci))
    except (OSError, CalibrationError) as error:
        rospy.logerr(f"[{cname}] file [{filename}] not saved: {error}")
        return False
    rospy.loginfo(f"writing calibration data to {filename}")
    return True


def _path(url: str, cname: str) -> str | None:
    """Return the path of the file at a URL. If the URL is invalid, log an error and return None."""
    found = resolveURL(url, cname)
    kind = parseURL(found)
    if kind == URL_empty:
        return _path(default_camera_info_url, cname)
    if kind == URL_file:
        return path_of_url(found)
    path = getPackageFileName(found) if kind == URL_package else ""
    if not path:
        rospy.logerr(f"invalid URL: {found} (ignored)")
    return path or None
