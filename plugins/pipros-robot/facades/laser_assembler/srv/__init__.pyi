"""Services of laser_assembler, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import time as _time
import sensor_msgs.msg

class AssembleScansRequest(_base.Message):
    """Requests the points of all scans measured in an interval."""
    begin: _time.Time
    """start of the interval; scans at this time are included"""
    end: _time.Time
    """end of the interval; scans at this time are not included"""
    def __init__(self, begin: _time.Time | None = ..., end: _time.Time | None = ...) -> None: ...

class AssembleScansResponse(_base.Message):
    cloud: sensor_msgs.msg.PointCloud
    """in the fixed frame, with the time of the last scan, or the end"""
    def __init__(self, cloud: sensor_msgs.msg.PointCloud | None = ...) -> None: ...

class AssembleScans2Request(_base.Message):
    """Requests the points of all scans measured in an interval."""
    begin: _time.Time
    """start of the interval; scans at this time are included"""
    end: _time.Time
    """end of the interval; scans at this time are not included"""
    def __init__(self, begin: _time.Time | None = ..., end: _time.Time | None = ...) -> None: ...

class AssembleScans2Response(_base.Message):
    cloud: sensor_msgs.msg.PointCloud2
    """in the fixed frame, with the time of the last scan, or the end"""
    def __init__(self, cloud: sensor_msgs.msg.PointCloud2 | None = ...) -> None: ...

class AssembleScans:
    """Requests the points of all scans measured in an interval."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[AssembleScansRequest]]
    _response_class: _ClassVar[type[AssembleScansResponse]]

class AssembleScans2:
    """Requests the points of all scans measured in an interval."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[AssembleScans2Request]]
    _response_class: _ClassVar[type[AssembleScans2Response]]
