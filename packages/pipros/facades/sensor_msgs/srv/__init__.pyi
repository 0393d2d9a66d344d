"""Services of sensor_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import sensor_msgs.msg

class SetCameraInfoRequest(_base.Message):
    """Stores a new calibration in a camera driver; camera_calibration calls it on CAMERA/set_camera_info."""
    camera_info: sensor_msgs.msg.CameraInfo
    """the calibration for the full image"""
    def __init__(self, camera_info: sensor_msgs.msg.CameraInfo | None = ...) -> None: ...

class SetCameraInfoResponse(_base.Message):
    success: bool
    """true if it was stored"""
    status_message: str
    """how it was stored, or why not"""
    def __init__(self, success: bool | None = ..., status_message: str | None = ...) -> None: ...

class SetCameraInfo:
    """Stores a new calibration in a camera driver; camera_calibration calls it on CAMERA/set_camera_info."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetCameraInfoRequest]]
    _response_class: _ClassVar[type[SetCameraInfoResponse]]
