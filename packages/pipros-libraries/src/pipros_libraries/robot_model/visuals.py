"""Read a URDF's shapes and materials, as drawn by rviz's RobotModel display."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pipros.safe.xml import Element
from pipros_libraries.robot_model.urdf import (
    UrdfError,
    Vector,
    numbers_of,
    optional_number,
    origin_of,
    required,
    robot_element,
    vector_of,
)
from pipros_libraries.transforms.pose import Pose

Color = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Shape:
    """A visual or collision shape of a link.

    Attributes:
        kind: box, cylinder, sphere or mesh.
        origin: the pose relative to the link.
        size: edge lengths of a box; (radius, radius, length) of a cylinder; (radius, radius, radius) of a
            sphere; scale factors of a mesh. Lengths are in metres.
        uri: URI of the mesh file; empty for the other kinds.
        color: the material's colour; None if there is none, in which case a mesh keeps its own materials.
        texture: URI of the material's texture; empty if there is none.
    """

    kind: str
    origin: Pose
    size: Vector
    uri: str = ""
    color: Color | None = None
    texture: str = ""


@dataclass(frozen=True, slots=True)
class LinkShapes:
    """All shapes of a link."""

    name: str
    visuals: tuple[Shape, ...] = field(default_factory=tuple)
    collisions: tuple[Shape, ...] = field(default_factory=tuple)


@dataclass(frozen=True, slots=True)
class _Material:
    color: Color | None
    texture: str


def read_shapes(text: str) -> list[LinkShapes]:
    """Return the links of a URDF with their shapes, in file order.

    A material name refers to the first definition with that name outside links or, if there is none, to the
    first in a link.

    Raises:
        UrdfError: the text is not XML or not a URDF, or a shape is invalid.
    """
    robot = robot_element(text)
    links = list(robot.all("link"))
    materials: dict[str, _Material] = {}
    in_links = (each for link in links for visual in link.all("visual") for each in visual.all("material"))
    for element in (*robot.all("material"), *in_links):
        material = _material(element)
        if material is not None:
            materials.setdefault(element.attributes.get("name", ""), material)
    return [
        LinkShapes(
            required(link, "name"),
            tuple(_shape(visual, materials) for visual in link.all("visual")),
            tuple(_shape(collision, {}) for collision in link.all("collision")),
        )
        for link in links
    ]


def _material(element: Element) -> _Material | None:
    """Return the material that an element defines, or None if it only refers to a material by name."""
    color, texture = element.first("color"), element.first("texture")
    if color is None and texture is None:
        return None
    rgba = None
    if color is not None:
        required(color, "rgba")
        r, g, b, a = (min(max(part, 0.0), 1.0) for part in numbers_of(color, "rgba", 4, ()))
        rgba = (r, g, b, a)
    return _Material(rgba, texture.attributes.get("filename", "") if texture is not None else "")


def _shape(element: Element, materials: Mapping[str, _Material]) -> Shape:
    geometry = element.first("geometry")
    if geometry is None:
        raise UrdfError(f"line {element.line}: <{element.tag}> must have a <geometry> element")
    color: Color | None = None
    texture = ""
    named = element.first("material")
    if named is not None:
        found = _material(named) or materials.get(named.attributes.get("name", ""))
        color, texture = (found.color, found.texture) if found is not None else (None, "")
    origin = origin_of(element)
    if (box := geometry.first("box")) is not None:
        return Shape("box", origin, vector_of(box, "size", (0.0, 0.0, 0.0)), "", color, texture)
    if (round_ := geometry.first("cylinder")) is not None:
        radius, length = (optional_number(round_, name) or 0.0 for name in ("radius", "length"))
        return Shape("cylinder", origin, (radius, radius, length), "", color, texture)
    if (sphere := geometry.first("sphere")) is not None:
        radius = optional_number(sphere, "radius") or 0.0
        return Shape("sphere", origin, (radius, radius, radius), "", color, texture)
    if (mesh := geometry.first("mesh")) is not None:
        scale = vector_of(mesh, "scale", (1.0, 1.0, 1.0))
        return Shape("mesh", origin, scale, required(mesh, "filename"), color, texture)
    raise UrdfError(f"line {geometry.line}: <geometry> must contain <box>, <cylinder>, <sphere> or <mesh>")


def named_files(links: list[LinkShapes]) -> frozenset[str]:
    """Return the URIs of all meshes and textures."""
    shapes = [shape for link in links for shape in (*link.visuals, *link.collisions)]
    return frozenset({uri for shape in shapes for uri in (shape.uri, shape.texture) if uri})
