"""Services of robot_pose_ekf, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class GetStatusRequest(_base.Message):
    """Return the state of the filter as text for humans."""
    def __init__(self) -> None: ...

class GetStatusResponse(_base.Message):
    status: str
    """one line for each sensor, with the number of received messages, and one for the filter"""
    def __init__(self, status: str | None = ...) -> None: ...

class GetStatus:
    """Return the state of the filter as text for humans."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetStatusRequest]]
    _response_class: _ClassVar[type[GetStatusResponse]]
