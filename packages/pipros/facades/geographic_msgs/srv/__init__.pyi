"""Services of geographic_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import geographic_msgs.msg
import uuid_msgs.msg

class GetGeoPathRequest(_base.Message):
    """Plans a path from one position to another."""
    start: geographic_msgs.msg.GeoPoint
    """where it begins"""
    goal: geographic_msgs.msg.GeoPoint
    """where it ends"""
    def __init__(self, start: geographic_msgs.msg.GeoPoint | None = ..., goal: geographic_msgs.msg.GeoPoint | None = ...) -> None: ...

class GetGeoPathResponse(_base.Message):
    success: bool
    """false: see status"""
    status: str
    """what went wrong, if anything"""
    plan: geographic_msgs.msg.GeoPath
    """the planned way"""
    network: uuid_msgs.msg.UniqueID
    """the network that was used"""
    start_seg: uuid_msgs.msg.UniqueID
    """the segment of the start"""
    goal_seg: uuid_msgs.msg.UniqueID
    """the segment of the goal"""
    distance: float
    """length of the path, metres"""
    def __init__(self, success: bool | None = ..., status: str | None = ..., plan: geographic_msgs.msg.GeoPath | None = ..., network: uuid_msgs.msg.UniqueID | None = ..., start_seg: uuid_msgs.msg.UniqueID | None = ..., goal_seg: uuid_msgs.msg.UniqueID | None = ..., distance: float | None = ...) -> None: ...

class GetGeographicMapRequest(_base.Message):
    """Requests a map."""
    url: str
    """where the map is from"""
    bounds: geographic_msgs.msg.BoundingBox
    """the region that is wanted"""
    def __init__(self, url: str | None = ..., bounds: geographic_msgs.msg.BoundingBox | None = ...) -> None: ...

class GetGeographicMapResponse(_base.Message):
    success: bool
    """false: see status"""
    status: str
    """what went wrong, if anything"""
    map: geographic_msgs.msg.GeographicMap
    """the requested part"""
    def __init__(self, success: bool | None = ..., status: str | None = ..., map: geographic_msgs.msg.GeographicMap | None = ...) -> None: ...

class GetRoutePlanRequest(_base.Message):
    """Plans a route through a network."""
    network: uuid_msgs.msg.UniqueID
    """the network of the route"""
    start: uuid_msgs.msg.UniqueID
    """a point"""
    goal: uuid_msgs.msg.UniqueID
    """another point"""
    def __init__(self, network: uuid_msgs.msg.UniqueID | None = ..., start: uuid_msgs.msg.UniqueID | None = ..., goal: uuid_msgs.msg.UniqueID | None = ...) -> None: ...

class GetRoutePlanResponse(_base.Message):
    success: bool
    """false: see status"""
    status: str
    """what went wrong, if anything"""
    plan: geographic_msgs.msg.RoutePath
    """the planned way"""
    def __init__(self, success: bool | None = ..., status: str | None = ..., plan: geographic_msgs.msg.RoutePath | None = ...) -> None: ...

class UpdateGeographicMapRequest(_base.Message):
    """Changes a map."""
    updates: geographic_msgs.msg.GeographicMapChanges
    """what is new, changed or removed"""
    def __init__(self, updates: geographic_msgs.msg.GeographicMapChanges | None = ...) -> None: ...

class UpdateGeographicMapResponse(_base.Message):
    success: bool
    """false: see status"""
    status: str
    """what went wrong, if anything"""
    def __init__(self, success: bool | None = ..., status: str | None = ...) -> None: ...

class GetGeoPath:
    """Plans a path from one position to another."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetGeoPathRequest]]
    _response_class: _ClassVar[type[GetGeoPathResponse]]

class GetGeographicMap:
    """Requests a map."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetGeographicMapRequest]]
    _response_class: _ClassVar[type[GetGeographicMapResponse]]

class GetRoutePlan:
    """Plans a route through a network."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetRoutePlanRequest]]
    _response_class: _ClassVar[type[GetRoutePlanResponse]]

class UpdateGeographicMap:
    """Changes a map."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[UpdateGeographicMapRequest]]
    _response_class: _ClassVar[type[UpdateGeographicMapResponse]]
