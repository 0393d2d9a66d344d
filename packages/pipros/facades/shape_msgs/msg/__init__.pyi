"""Messages of shape_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import geometry_msgs.msg

class Mesh(_base.Message):
    """A surface of triangles, such as a collision body. It contains no frame: its pose is sent with it."""
    triangles: list[MeshTriangle]
    """which vertices make up each triangle"""
    vertices: list[geometry_msgs.msg.Point]
    """corners that triangles may share, metres"""
    def __init__(self, triangles: list[MeshTriangle] | None = ..., vertices: list[geometry_msgs.msg.Point] | None = ...) -> None: ...

class MeshTriangle(_base.Message):
    """One triangle of a Mesh. By convention, its corners are in counter-clockwise order, seen from outside."""
    @property
    def vertex_indices(self) -> _Sequence[int]:
        """its corners, as indices into the vertices of the mesh"""
    @vertex_indices.setter
    def vertex_indices(self, value: _types.Array[int]) -> None: ...
    def __init__(self, vertex_indices: _types.Array[int] | None = ...) -> None: ...

class Plane(_base.Message):
    """A plane: all points for which a x + b y + c z + d is 0."""
    @property
    def coef(self) -> _Sequence[float]:
        """a, b, c and d; with (a, b, c) of length 1, d is minus the distance along it, metres"""
    @coef.setter
    def coef(self, value: _types.Array[float]) -> None: ...
    def __init__(self, coef: _types.Array[float] | None = ...) -> None: ...

class SolidPrimitive(_base.Message):
    """A box, sphere, cylinder or cone about its own centre, with its height along z. Its pose is sent with it."""
    BOX: _Final = 1
    """needs 3 dimensions"""
    SPHERE: _Final = 2
    """needs 1 dimension"""
    CYLINDER: _Final = 3
    """needs 2 dimensions"""
    CONE: _Final = 4
    """needs 2 dimensions"""
    BOX_X: _Final = 0
    """index of a box's whole edge along x"""
    BOX_Y: _Final = 1
    """index of a box's whole edge along y"""
    BOX_Z: _Final = 2
    """index of a box's whole edge along z"""
    SPHERE_RADIUS: _Final = 0
    """index of a sphere's radius"""
    CYLINDER_HEIGHT: _Final = 0
    """index of a cylinder's height"""
    CYLINDER_RADIUS: _Final = 1
    """index of a cylinder's radius"""
    CONE_HEIGHT: _Final = 0
    """index of a cone's height; its tip points along +z"""
    CONE_RADIUS: _Final = 1
    """index of the radius of a cone's base"""
    type: int
    """BOX, SPHERE, CYLINDER or CONE"""
    @property
    def dimensions(self) -> _Sequence[float]:
        """metres; the indices below define their order"""
    @dimensions.setter
    def dimensions(self, value: _types.Array[float]) -> None: ...
    def __init__(self, type: int | None = ..., dimensions: _types.Array[float] | None = ...) -> None: ...
