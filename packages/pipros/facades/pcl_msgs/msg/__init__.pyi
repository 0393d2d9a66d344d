"""Messages of pcl_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import sensor_msgs.msg
import std_msgs.msg

class ModelCoefficients(_base.Message):
    """Coefficients of a model fitted to points, such as a, b, c and d of a plane."""
    header: std_msgs.msg.Header
    """the header of the cloud"""
    @property
    def values(self) -> _Sequence[float]:
        """in the order of the model; lengths in metres"""
    @values.setter
    def values(self, value: _types.Array[float]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., values: _types.Array[float] | None = ...) -> None: ...

class PointIndices(_base.Message):
    """A subset of the points in a cloud, such as a cluster."""
    header: std_msgs.msg.Header
    """the header of the cloud"""
    @property
    def indices(self) -> _Sequence[int]:
        """indices of the points, counted from 0"""
    @indices.setter
    def indices(self, value: _types.Array[int]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., indices: _types.Array[int] | None = ...) -> None: ...

class PolygonMesh(_base.Message):
    """A surface of polygons over the points of a cloud."""
    header: std_msgs.msg.Header
    """stamp and frame of the cloud"""
    cloud: sensor_msgs.msg.PointCloud2
    """the corners"""
    polygons: list[Vertices]
    """which corners make up each polygon"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., cloud: sensor_msgs.msg.PointCloud2 | None = ..., polygons: list[Vertices] | None = ...) -> None: ...

class Vertices(_base.Message):
    """One polygon of a PolygonMesh."""
    @property
    def vertices(self) -> _Sequence[int]:
        """its corners in order, as indices of points in the cloud"""
    @vertices.setter
    def vertices(self, value: _types.Array[int]) -> None: ...
    def __init__(self, vertices: _types.Array[int] | None = ...) -> None: ...
