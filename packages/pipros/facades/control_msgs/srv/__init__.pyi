"""Services of control_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time

class QueryCalibrationStateRequest(_base.Message):
    """Returns whether the joints have found their zero positions. The request is empty."""
    def __init__(self) -> None: ...

class QueryCalibrationStateResponse(_base.Message):
    is_calibrated: bool
    """true if all have found it"""
    def __init__(self, is_calibrated: bool | None = ...) -> None: ...

class QueryTrajectoryStateRequest(_base.Message):
    """Returns a trajectory controller's actual or planned state of the joints at a time."""
    time: _time.Time
    """time of the state"""
    def __init__(self, time: _time.Time | None = ...) -> None: ...

class QueryTrajectoryStateResponse(_base.Message):
    name: list[str]
    """the joints, in the order of the values"""
    @property
    def position(self) -> _Sequence[float]:
        """radians or metres"""
    @position.setter
    def position(self, value: _types.Array[float]) -> None: ...
    @property
    def velocity(self) -> _Sequence[float]:
        """radians or metres per second"""
    @velocity.setter
    def velocity(self, value: _types.Array[float]) -> None: ...
    @property
    def acceleration(self) -> _Sequence[float]:
        """radians or metres per second squared"""
    @acceleration.setter
    def acceleration(self, value: _types.Array[float]) -> None: ...
    def __init__(self, name: list[str] | None = ..., position: _types.Array[float] | None = ..., velocity: _types.Array[float] | None = ..., acceleration: _types.Array[float] | None = ...) -> None: ...

class QueryCalibrationState:
    """Returns whether the joints have found their zero positions. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[QueryCalibrationStateRequest]]
    _response_class: _ClassVar[type[QueryCalibrationStateResponse]]

class QueryTrajectoryState:
    """Returns a trajectory controller's actual or planned state of the joints at a time."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[QueryTrajectoryStateRequest]]
    _response_class: _ClassVar[type[QueryTrajectoryStateResponse]]
