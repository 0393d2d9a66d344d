"""Services of robot_localization, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time
import geographic_msgs.msg
import geometry_msgs.msg

class FromLLRequest(_base.Message):
    """Converts a geographic position to the world frame of navsat_transform_node."""
    ll_point: geographic_msgs.msg.GeoPoint
    """latitude and longitude in degrees, altitude in metres"""
    def __init__(self, ll_point: geographic_msgs.msg.GeoPoint | None = ...) -> None: ...

class FromLLResponse(_base.Message):
    map_point: geometry_msgs.msg.Point
    """metres, in the frame of the odometry"""
    def __init__(self, map_point: geometry_msgs.msg.Point | None = ...) -> None: ...

class GetStateRequest(_base.Message):
    """Requests the state of a filter at a time. No node of pipros offers this service."""
    time_stamp: _time.Time
    """the time of the wanted state"""
    frame_id: str
    """the frame in which the state is wanted"""
    def __init__(self, time_stamp: _time.Time | None = ..., frame_id: str | None = ...) -> None: ...

class GetStateResponse(_base.Message):
    @property
    def state(self) -> _Sequence[float]:
        """position, angles, their velocities, and accelerations"""
    @state.setter
    def state(self, value: _types.Array[float]) -> None: ...
    @property
    def covariance(self) -> _Sequence[float]:
        """15 x 15, row by row"""
    @covariance.setter
    def covariance(self, value: _types.Array[float]) -> None: ...
    def __init__(self, state: _types.Array[float] | None = ..., covariance: _types.Array[float] | None = ...) -> None: ...

class SetDatumRequest(_base.Message):
    """Sets the origin of the world frame: where it is, and its orientation."""
    geo_pose: geographic_msgs.msg.GeoPose
    """a yaw of 0 is east"""
    def __init__(self, geo_pose: geographic_msgs.msg.GeoPose | None = ...) -> None: ...

class SetDatumResponse(_base.Message):
    def __init__(self) -> None: ...

class SetPoseRequest(_base.Message):
    """Restarts the filter at a pose, with velocities and accelerations 0."""
    pose: geometry_msgs.msg.PoseWithCovarianceStamped
    """in any frame that can be transformed to the world frame"""
    def __init__(self, pose: geometry_msgs.msg.PoseWithCovarianceStamped | None = ...) -> None: ...

class SetPoseResponse(_base.Message):
    def __init__(self) -> None: ...

class SetUTMZoneRequest(_base.Message):
    """Sets the UTM zone for the conversion of positions."""
    utm_zone: str
    """number and band, such as 31U"""
    def __init__(self, utm_zone: str | None = ...) -> None: ...

class SetUTMZoneResponse(_base.Message):
    def __init__(self) -> None: ...

class ToLLRequest(_base.Message):
    """Converts a position in the world frame of navsat_transform_node to a geographic one."""
    map_point: geometry_msgs.msg.Point
    """metres, in the frame of the odometry"""
    def __init__(self, map_point: geometry_msgs.msg.Point | None = ...) -> None: ...

class ToLLResponse(_base.Message):
    ll_point: geographic_msgs.msg.GeoPoint
    """latitude and longitude in degrees, altitude in metres"""
    def __init__(self, ll_point: geographic_msgs.msg.GeoPoint | None = ...) -> None: ...

class ToggleFilterProcessingRequest(_base.Message):
    """Stops or continues the processing of measurements; messages that arrive in between are dropped."""
    on: bool
    """true: process measurements"""
    def __init__(self, on: bool | None = ...) -> None: ...

class ToggleFilterProcessingResponse(_base.Message):
    status: bool
    """false: processing was already on or off, as requested"""
    def __init__(self, status: bool | None = ...) -> None: ...

class FromLL:
    """Converts a geographic position to the world frame of navsat_transform_node."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[FromLLRequest]]
    _response_class: _ClassVar[type[FromLLResponse]]

class GetState:
    """Requests the state of a filter at a time. No node of pipros offers this service."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetStateRequest]]
    _response_class: _ClassVar[type[GetStateResponse]]

class SetDatum:
    """Sets the origin of the world frame: where it is, and its orientation."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetDatumRequest]]
    _response_class: _ClassVar[type[SetDatumResponse]]

class SetPose:
    """Restarts the filter at a pose, with velocities and accelerations 0."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetPoseRequest]]
    _response_class: _ClassVar[type[SetPoseResponse]]

class SetUTMZone:
    """Sets the UTM zone for the conversion of positions."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetUTMZoneRequest]]
    _response_class: _ClassVar[type[SetUTMZoneResponse]]

class ToLL:
    """Converts a position in the world frame of navsat_transform_node to a geographic one."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ToLLRequest]]
    _response_class: _ClassVar[type[ToLLResponse]]

class ToggleFilterProcessing:
    """Stops or continues the processing of measurements; messages that arrive in between are dropped."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ToggleFilterProcessingRequest]]
    _response_class: _ClassVar[type[ToggleFilterProcessingResponse]]
