"""Services of polled_camera, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import time as _time
import sensor_msgs.msg

class GetPolledImageRequest(_base.Message):
    """Requests one image from a camera, which offers it as CAMERA/request_image."""
    response_namespace: str
    """the image is published on RESPONSE_NAMESPACE/image_raw and camera_info"""
    timeout: _time.Duration
    """how long to wait for the camera; 0: no limit"""
    binning_x: int
    """number of columns to combine; 0: as configured"""
    binning_y: int
    """number of rows to combine; 0: as configured"""
    roi: sensor_msgs.msg.RegionOfInterest
    """part of the image; all zeros: the whole image"""
    def __init__(self, response_namespace: str | None = ..., timeout: _time.Duration | None = ..., binning_x: int | None = ..., binning_y: int | None = ..., roi: sensor_msgs.msg.RegionOfInterest | None = ...) -> None: ...

class GetPolledImageResponse(_base.Message):
    success: bool
    """true if there is an image"""
    status_message: str
    """human-readable: why there is no image"""
    stamp: _time.Time
    """header.stamp of the image"""
    def __init__(self, success: bool | None = ..., status_message: str | None = ..., stamp: _time.Time | None = ...) -> None: ...

class GetPolledImage:
    """Requests one image from a camera, which offers it as CAMERA/request_image."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetPolledImageRequest]]
    _response_class: _ClassVar[type[GetPolledImageResponse]]
