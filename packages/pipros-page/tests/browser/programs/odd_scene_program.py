"""Messages and files that rviz takes although they are odd, below /odd. Argument: a folder for meshes.

Markers stand in columns by type, and in rows by what is odd about them.
"""

from __future__ import annotations

import math
import struct
import sys
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

from geometry_msgs.msg import Point, Point32, PolygonStamped, Pose, PoseArray, PoseStamped, TransformStamped
from nav_msgs.msg import GridCells, Odometry
from nav_msgs.msg import Path as Way
from sensor_msgs.msg import ChannelFloat32, LaserScan, PointCloud, PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

import rospy
import tf2_ros

NAN, INF = math.nan, math.inf
HEADER = Header(frame_id="map")
SOLIDS = [Marker.ARROW, Marker.CUBE, Marker.SPHERE, Marker.CYLINDER]
LISTS = [Marker.LINE_STRIP, Marker.LINE_LIST, Marker.CUBE_LIST, Marker.SPHERE_LIST, Marker.POINTS]
LISTS.append(Marker.TRIANGLE_LIST)
SQUARE = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
BENT = [(-0.6, -0.3), (-0.4, -0.2), (-0.1, -0.1), (0.2, 0.0), (0.4, 0.1), (0.6, 0.3)]
TINTS = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0), (0.0, 1.0, 1.0), (1.0, 0.0, 1.0)]
Change = Callable[[Marker], None]


def marker(kind: int) -> Marker:
    made = Marker(header=HEADER, ns="odd", type=kind)
    made.pose.orientation.w = 1.0
    is_line = kind in (Marker.LINE_STRIP, Marker.LINE_LIST)
    is_solid = kind in SOLIDS or kind in (Marker.TRIANGLE_LIST, Marker.MESH_RESOURCE)
    made.scale.x = 0.25 if is_line else 1.0 if is_solid else 0.45
    made.scale.y = made.scale.z = made.scale.x
    if kind == Marker.ARROW:
        made.scale.y = made.scale.z = 0.35
    made.color = ColorRGBA(0.9, 0.5, 0.1, 1.0)
    if kind in LISTS:
        made.points = [Point(x, y, 0) for x, y in (BENT if kind == Marker.LINE_STRIP else SQUARE)]
    return made


def rows(kinds: Sequence[int], changes: Sequence[Change]) -> MarkerArray:
    """Return a marker for each type and change; each change makes a row."""
    found = []
    for row, change in enumerate(changes):
        for column, kind in enumerate(kinds):
            made = marker(kind)
            made.id = len(found)
            made.pose.position.x, made.pose.position.y = 1.7 * column - 7.5, 5.0 - 1.6 * row
            change(made)
            found.append(made)
    return MarkerArray(found)


def number(path: str, value: float) -> Change:
    """Return a change of one number, such as `points.0.x`."""

    def change(made: Marker) -> None:
        *parents, last = path.split(".")
        at = made
        for name in parents:
            if name.isdigit() and int(name) >= len(at):
                return
            at = at[int(name)] if name.isdigit() else getattr(at, name)
        setattr(at, last, value)

    return change


def tints(count: int, alphas: Sequence[float], alpha: float) -> Change:
    """Return a change of the colours of points, with alphas in turn, and of the marker's alpha."""

    def change(made: Marker) -> None:
        made.colors = [ColorRGBA(*TINTS[i % 6], alphas[i % len(alphas)]) for i in range(count)]
        made.color.a = alpha

    return change


def both(*changes: Change) -> Change:
    def change(made: Marker) -> None:
        for each in changes:
            each(made)

    return change


def odd_numbers(kinds: Sequence[int]) -> MarkerArray:
    spoilt = [number("points.3.x", NAN), number("points.0.z", INF)]
    return rows(kinds, [*spoilt, number("scale.z", 0.3)])


def odd_tints() -> MarkerArray:
    spoilt = [number("color.g", NAN), number("color.a", NAN)]
    spoilt += [both(tints(6, [1.0], 1.0), number("colors.1.r", NAN))]
    return rows([*SOLIDS, *LISTS], [*spoilt, number("scale.z", 0.3)])


def odd_poses() -> MarkerArray:
    spoilt = [number("pose.position.z", NAN), number("pose.orientation.w", INF), number("scale.y", NAN)]
    return rows([*SOLIDS, *LISTS], [*spoilt, number("scale.z", 0.3)])


def odd_colours() -> MarkerArray:
    return rows(
        LISTS,
        [tints(0, [1.0], 0.4), tints(6, [1.0], 1.0), tints(6, [1.0], 0.4), tints(6, [0.4], 1.0),
            tints(6, [0.4, 1.0], 0.5), tints(6, [0.0, 1.0], 1.0), tints(6, [1.0], 0.0)],
    )  # fmt: skip


def odd_counts() -> MarkerArray:
    bright = both(number("color.r", 2.0), number("color.g", -1.0))
    changes = [tints(2, [0.4], 1.0), tints(2, [1.0], 0.4), tints(5, [1.0], 1.0), tints(9, [1.0], 1.0)]
    return rows([*SOLIDS, *LISTS], [*changes, bright, number("color.a", 2.0), number("color.a", -1.0)])


def odd_sizes() -> MarkerArray:
    changes = [number(f"scale.{axis}", 0.0) for axis in "xyz"]
    changes += [number(f"scale.{axis}", -0.5) for axis in "xyz"]
    return rows([*SOLIDS, *LISTS], [*changes, both(*(number(f"scale.{axis}", -0.5) for axis in "xyz"))])


def odd_arrows() -> MarkerArray:
    def between(x: float, y: float) -> Change:
        def change(made: Marker) -> None:
            made.points = [Point(-0.5, 0, 0), Point(x, y, 0)]
            made.scale.x, made.scale.y, made.scale.z = 0.2, 0.4, 0.3

        return change

    usual = between(0.6, 0.2)
    changes = [usual]
    changes += [both(usual, number(f"scale.{axis}", size)) for axis in "xyz" for size in (0.0, -0.3)]
    found = rows([Marker.ARROW], changes)
    for place, each in enumerate(found.markers):
        each.pose.position.x, each.pose.position.y = 2.0 * (place % 3) - 2, 2.0 - 2 * (place // 3)
    return found


def long_lines() -> MarkerArray:
    made = [marker(Marker.LINE_STRIP), marker(Marker.LINE_LIST)]
    made[0].points = [Point(-800, 1, 0), Point(900, 2, 0), Point(900, 300, 0)]
    made[1].points = [Point(-3, -600, 0), Point(-2, 900, 0), Point(0, 0, -900), Point(0, 0, 1200)]
    made[1].id = 1
    return MarkerArray(made)


def cloud(points: Sequence[tuple[float, ...]], names: str = "xyzi") -> PointCloud2:
    fields = [PointField("intensity" if name == "i" else name, 4 * i, 7, 1) for i, name in enumerate(names)]
    step = 4 * len(names)
    made = PointCloud2(HEADER, 1, len(points), fields, False, step, step * len(points), b"", True)
    made.data = b"".join(struct.pack(f"<{len(names)}f", *point) for point in points)
    return made


def fine_cloud() -> PointCloud2:
    """Return a field of points that are 7 cm apart."""
    return cloud([(0.07 * x - 5, 0.07 * y - 5, 0.0, 0.0) for x in range(140) for y in range(140)])


def arrays() -> dict[str, object]:
    """Return messages with numbers that are not finite in their arrays."""
    way = Way(header=HEADER, poses=[PoseStamped(pose=pose(x, -4)) for x in (-6, -3, NAN, 3, 6)])
    turned = Way(header=HEADER, poses=[PoseStamped(pose=pose(x, -5)) for x in (-6, -3, 3)])
    turned.poses[1].pose.orientation.z = NAN
    polygon = PolygonStamped(header=HEADER)
    polygon.polygon.points = [Point32(-6, 0, 0), Point32(-3, 0, 0), Point32(-4, NAN, 0), Point32(-4, 3, 0)]
    cells = GridCells(HEADER, 1.0, 0.5, [Point(-1, 0, 0), Point(0, NAN, 0), Point(1, 0, 0)])
    poses = PoseArray(HEADER, [pose(-1, 2), pose(NAN, 2), pose(1, 2)])
    odometry = Odometry(header=HEADER)
    odometry.pose.pose = pose(3, 2)
    odometry.pose.covariance[0] = NAN
    old = PointCloud(HEADER, [Point32(3, 0, 0), Point32(NAN, 0, 0), Point32(5, 0, 0)], [])
    old.channels = [ChannelFloat32("heat", [10, 20, NAN])]
    scan = LaserScan(header=HEADER, range_min=0.5, range_max=9.0, angle_increment=0.5)
    scan.ranges, scan.intensities = [3.0, NAN, INF, -INF, 4.0, 5.0, 6.0], [0, 1, 2, 3, NAN, INF, 10]
    points = [
        (-6, 4, 0, 0), (-5, 4, 0, NAN), (-4, 4, 0, 50), (-3, 4, 0, INF), (-2, 4, 0, -INF), (-1, 4, 0, 100)
    ]  # fmt: skip
    points += [(0, 4, NAN, 7), (INF, 4, 0, 7), (2, 4, 0, 25)]
    long = Way(header=HEADER, poses=[PoseStamped(pose=pose(x, y)) for x, y in ((-900, 2), (0, 2), (500, 40))])
    return {
        "path": way, "turned_path": turned, "long_path": long, "polygon": polygon, "cells": cells,
        "poses": poses, "odom": odometry, "old_cloud": old, "scan": scan, "cloud": cloud(points),
        "fine_cloud": fine_cloud(),
    }  # fmt: skip


def pose(x: float, y: float) -> Pose:
    made = Pose(position=Point(x, y, 0.0))
    made.orientation.w = 1.0
    return made


def png(colour: tuple[int, int, int]) -> bytes:
    """Return a picture of 4 x 4 pixels of one colour."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    lines = (b"\0" + bytes(colour) * 4) * 4
    head = struct.pack(">2I5B", 4, 4, 8, 2, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


OBJ = """mtllib {name}.mtl
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
usemtl m
f 1/1/1 2/2/1 3/3/1 4/4/1
"""
DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><up_axis>Z_UP</up_axis></asset>{image}
<library_effects><effect id="e"><profile_COMMON>{sampler}<technique sid="t"><lambert>
<diffuse>{diffuse}</diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">-1 -1 0 1 -1 0 1 1 0 -1 1 0</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="n"><float_array id="na" count="3">0 0 1</float_array><technique_common>
<accessor source="#na" count="1" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="t"><float_array id="ta" count="8">0 0 1 0 1 1 0 1</float_array><technique_common>
<accessor source="#ta" count="4" stride="2"><param name="S" type="float"/><param name="T" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="2" material="mm">
<input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="1"/>
<input semantic="TEXCOORD" source="#t" offset="2" set="0"/>
<p>0 0 0 1 0 1 2 0 2 0 0 0 2 0 2 3 0 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="x"><instance_geometry url="#g"><bind_material>
<technique_common><instance_material symbol="mm" target="#m"><bind_vertex_input semantic="UV"
input_semantic="TEXCOORD" input_set="0"/></instance_material></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""
IMAGE = '<library_images><image id="i"><init_from>square.png</init_from></image></library_images>'
SAMPLER = (
    '<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>'
    '<newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>'
)
STL = """solid a
facet normal 0 0 1
outer loop
vertex -1 -1 0
vertex 1 -1 0
vertex 1 1 0
endloop
endfacet
endsolid a
"""


def meshes(folder: Path) -> list[str]:
    """Write squares with a texture or a colour, and return their addresses."""
    (folder / "square.png").write_bytes(png((100, 150, 200)))
    plain = {"image": "", "sampler": "", "diffuse": "<color>0.2 0.4 0.9 1</color>"}
    faint = {**plain, "diffuse": "<color>0.2 0.4 0.9 0.5</color>"}
    textured = {"image": IMAGE, "sampler": SAMPLER, "diffuse": '<texture texture="s" texcoord="UV"/>'}
    files = {
        "plain.dae": DAE.format(**plain), "faint.dae": DAE.format(**faint),
        "textured.dae": DAE.format(**textured), "plain.obj": OBJ.format(name="plain"),
        "plain.mtl": "newmtl m\nKd 0.2 0.4 0.9\n", "textured.obj": OBJ.format(name="textured"),
        "textured.mtl": "newmtl m\nKd 1 1 1\nmap_Kd square.png\n", "tinted.obj": OBJ.format(name="tinted"),
        "tinted.mtl": "newmtl m\nKd 0.5 1 0.5\nKa 0.5 0.5 0.5\nKs 0.2 0.2 0.2\nmap_Kd square.png\n",
        "half.stl": STL,
    }  # fmt: skip
    for name, text in files.items():
        (folder / name).write_text(text)
    return [f"file://{folder / name}" for name in files if not name.endswith(".mtl")]


def odd_meshes(uris: Sequence[str]) -> MarkerArray:
    """Return a row for each choice of colours, with a column for each mesh."""
    found = []
    colours = [(0.0, 0.0, 0.0, 0.0), (0.9, 0.5, 0.1, 1.0), (0.9, 0.5, 0.1, 0.4), (1.0, 1.0, 1.0, 1.0)]
    choices = [(own, colour) for colour in colours for own in (True, False)]
    for row, (own, colour) in enumerate(choices[:7]):
        for column, uri in enumerate(uris):
            made = marker(Marker.MESH_RESOURCE)
            made.id, made.mesh_resource, made.mesh_use_embedded_materials = len(found), uri, own
            made.scale.x = made.scale.y = made.scale.z = 0.7
            made.pose.position.x, made.pose.position.y = 1.9 * column - 6, 5.0 - 1.6 * row
            made.color = ColorRGBA(*colour)
            found.append(made)
    return MarkerArray(found)


def robot(uris: Sequence[str]) -> str:
    """Return a robot of the meshes, with and without materials, in XML that only TinyXML reads."""
    visuals = [
        f'<visual><origin xyz="{2.5 * column - 7} {3 * row - 2} 0"/><geometry><mesh filename="{uri}"/>'
        f"</geometry>{material}</visual>"
        for column, uri in enumerate(uris)
        for row, material in enumerate(("", '<material name="m"/>', '<material name="t"/>'))
    ]
    texture = uris[0].rsplit("/", 1)[0] + "/square.png"
    materials = '<material name="m"><color rgba="0.9 0.6 0.1 1"/></material>'
    materials += f'<material name="t"><texture filename="{texture}"/></material>'
    box = (
        '<visual><origin xyz="0 -4 0"/><geometry><box size="1 1 1"/></geometry><material name="t"/></visual>'
    )
    body = f'<robot name="odd & lenient">{materials}<link name="map">{"".join(visuals)}{box}</link></robot>'
    return f'\n  <!-- a -- b -->\n<?xml version="1.0"?>\n{body}\nrest'


def main() -> None:
    rospy.init_node("odd_scene_program")
    uris = meshes(Path(sys.argv[1]))
    rospy.set_param("/odd_robot", robot(uris))
    frames = tf2_ros.StaticTransformBroadcaster()
    sent = []
    for name, x, y in (("far", 300.0, 20.0), ("behind", -200.0, -90.0)):
        made = TransformStamped(header=HEADER, child_frame_id=name)
        made.transform.translation.x, made.transform.translation.y, made.transform.rotation.w = x, y, 1.0
        sent.append(made)
    messages = {
        "numbers": odd_numbers(LISTS[:1]), "line_numbers": odd_numbers(LISTS[1:2]),
        "point_numbers": odd_numbers(LISTS[2:5]), "triangle_numbers": odd_numbers(LISTS[5:]),
        "tints": odd_tints(), "spoilt_poses": odd_poses(), "colours": odd_colours(), "counts": odd_counts(),
        "sizes": odd_sizes(), "arrows": odd_arrows(), "long_lines": long_lines(), "meshes": odd_meshes(uris),
    } | arrays()  # fmt: skip
    publishers = {
        name: rospy.Publisher(f"/odd/{name}", type(message), queue_size=1, latch=True)
        for name, message in messages.items()
    }
    frames.sendTransform(sent)
    rate = rospy.Rate(1)
    while not rospy.is_shutdown():
        for name, message in messages.items():
            publishers[name].publish(message)
        rate.sleep()


if __name__ == "__main__":
    main()
