"""Messages of costmap_2d, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import geometry_msgs.msg
import std_msgs.msg

class VoxelGrid(_base.Message):
    """The columns of a voxel layer."""
    header: std_msgs.msg.Header
    """time, and the frame of the grid"""
    @property
    def data(self) -> _Sequence[int]:
        """per column, row by row: bits 0 to 15 are voxels unknown or marked, bits 16 to 31 marked"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    origin: geometry_msgs.msg.Point32
    """the lower left corner of the lowest voxels, in metres"""
    resolutions: geometry_msgs.msg.Vector3
    """size of a voxel in metres"""
    size_x: int
    """number of columns in x"""
    size_y: int
    """number of columns in y"""
    size_z: int
    """number of voxels in a column"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., data: _types.Array[int] | None = ..., origin: geometry_msgs.msg.Point32 | None = ..., resolutions: geometry_msgs.msg.Vector3 | None = ..., size_x: int | None = ..., size_y: int | None = ..., size_z: int | None = ...) -> None: ...
