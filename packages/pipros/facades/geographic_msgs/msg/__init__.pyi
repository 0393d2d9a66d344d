"""Messages of geographic_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import geometry_msgs.msg
import std_msgs.msg
import uuid_msgs.msg

class BoundingBox(_base.Message):
    """A region of the earth between two corners. A region across longitude 180 has a minimum greater
    than its maximum."""
    min_pt: GeoPoint
    """the corner with the lowest latitude, longitude and altitude"""
    max_pt: GeoPoint
    """the opposite corner; altitudes are NaN if the region is flat"""
    def __init__(self, min_pt: GeoPoint | None = ..., max_pt: GeoPoint | None = ...) -> None: ...

class GeoPath(_base.Message):
    """A path of geographic poses."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    poses: list[GeoPoseStamped]
    """in the order in which they are passed"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., poses: list[GeoPoseStamped] | None = ...) -> None: ...

class GeoPoint(_base.Message):
    """A position on the earth, on the ellipsoid WGS84."""
    latitude: float
    """degrees, from -90 to 90; north is positive"""
    longitude: float
    """degrees, from -180 to 180; east is positive"""
    altitude: float
    """metres above the ellipsoid; NaN if it is unknown"""
    def __init__(self, latitude: float | None = ..., longitude: float | None = ..., altitude: float | None = ...) -> None: ...

class GeoPointStamped(_base.Message):
    """A position on the earth at a time."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    position: GeoPoint
    """latitude, longitude and altitude"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., position: GeoPoint | None = ...) -> None: ...

class GeoPose(_base.Message):
    """A position on the earth, and an orientation."""
    position: GeoPoint
    """latitude, longitude and altitude"""
    orientation: geometry_msgs.msg.Quaternion
    """relative to east, north and up at the position"""
    def __init__(self, position: GeoPoint | None = ..., orientation: geometry_msgs.msg.Quaternion | None = ...) -> None: ...

class GeoPoseStamped(_base.Message):
    """A geographic pose at a time."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    pose: GeoPose
    """position and orientation"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., pose: GeoPose | None = ...) -> None: ...

class GeoPoseWithCovariance(_base.Message):
    """A geographic pose with its uncertainty."""
    pose: GeoPose
    """position and orientation"""
    @property
    def covariance(self) -> _Sequence[float]:
        """6 x 6, row by row: east, north, up (metres), and rotations about them (radians)"""
    @covariance.setter
    def covariance(self, value: _types.Array[float]) -> None: ...
    def __init__(self, pose: GeoPose | None = ..., covariance: _types.Array[float] | None = ...) -> None: ...

class GeoPoseWithCovarianceStamped(_base.Message):
    """An uncertain geographic pose at a time."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    pose: GeoPoseWithCovariance
    """position and orientation"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., pose: GeoPoseWithCovariance | None = ...) -> None: ...

class GeographicMap(_base.Message):
    """A part of a map of the earth, as of OpenStreetMap."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    id: uuid_msgs.msg.UniqueID
    """of this map"""
    bounds: BoundingBox
    """the region that it covers"""
    points: list[WayPoint]
    """all points that features refer to"""
    features: list[MapFeature]
    """such as roads and areas"""
    props: list[KeyValue]
    """properties"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., id: uuid_msgs.msg.UniqueID | None = ..., bounds: BoundingBox | None = ..., points: list[WayPoint] | None = ..., features: list[MapFeature] | None = ..., props: list[KeyValue] | None = ...) -> None: ...

class GeographicMapChanges(_base.Message):
    """Changes of a geographic map."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    diffs: GeographicMap
    """points and features that are new or changed"""
    deletes: list[uuid_msgs.msg.UniqueID]
    """points and features that are removed"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., diffs: GeographicMap | None = ..., deletes: list[uuid_msgs.msg.UniqueID] | None = ...) -> None: ...

class KeyValue(_base.Message):
    """A property of a geographic object."""
    key: str
    """name of the property"""
    value: str
    """as text"""
    def __init__(self, key: str | None = ..., value: str | None = ...) -> None: ...

class MapFeature(_base.Message):
    """A feature of a map, such as a road or a building."""
    id: uuid_msgs.msg.UniqueID
    """of this object"""
    components: list[uuid_msgs.msg.UniqueID]
    """its points or other features, in order"""
    props: list[KeyValue]
    """properties"""
    def __init__(self, id: uuid_msgs.msg.UniqueID | None = ..., components: list[uuid_msgs.msg.UniqueID] | None = ..., props: list[KeyValue] | None = ...) -> None: ...

class RouteNetwork(_base.Message):
    """A network of roads: segments between points."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    id: uuid_msgs.msg.UniqueID
    """of this network"""
    bounds: BoundingBox
    """the region that it covers"""
    points: list[WayPoint]
    """the points of the segments"""
    segments: list[RouteSegment]
    """connections between the points"""
    props: list[KeyValue]
    """properties"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., id: uuid_msgs.msg.UniqueID | None = ..., bounds: BoundingBox | None = ..., points: list[WayPoint] | None = ..., segments: list[RouteSegment] | None = ..., props: list[KeyValue] | None = ...) -> None: ...

class RoutePath(_base.Message):
    """A route through a network."""
    header: std_msgs.msg.Header
    """time, and a frame whose axes are east, north and up"""
    network: uuid_msgs.msg.UniqueID
    """the network of the segments"""
    segments: list[uuid_msgs.msg.UniqueID]
    """in the order in which they are passed"""
    props: list[KeyValue]
    """properties"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., network: uuid_msgs.msg.UniqueID | None = ..., segments: list[uuid_msgs.msg.UniqueID] | None = ..., props: list[KeyValue] | None = ...) -> None: ...

class RouteSegment(_base.Message):
    """A connection between two points of a network, in one direction."""
    id: uuid_msgs.msg.UniqueID
    """of this object"""
    start: uuid_msgs.msg.UniqueID
    """a point"""
    end: uuid_msgs.msg.UniqueID
    """another point"""
    props: list[KeyValue]
    """properties"""
    def __init__(self, id: uuid_msgs.msg.UniqueID | None = ..., start: uuid_msgs.msg.UniqueID | None = ..., end: uuid_msgs.msg.UniqueID | None = ..., props: list[KeyValue] | None = ...) -> None: ...

class WayPoint(_base.Message):
    """A named point of a map or network."""
    id: uuid_msgs.msg.UniqueID
    """of this object"""
    position: GeoPoint
    """latitude, longitude and altitude"""
    props: list[KeyValue]
    """properties"""
    def __init__(self, id: uuid_msgs.msg.UniqueID | None = ..., position: GeoPoint | None = ..., props: list[KeyValue] | None = ...) -> None: ...
