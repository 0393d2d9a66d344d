"""Messages, transforms and meshes that no display can show, below /bad. Argument: a folder for meshes."""

from __future__ import annotations

import math
import struct
import sys
from pathlib import Path
from typing import Any

from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Vector3,
    WrenchStamped,
)
from nav_msgs.msg import GridCells, OccupancyGrid, Odometry
from nav_msgs.msg import Path as Way
from sensor_msgs.msg import CameraInfo, Image, Imu, PointCloud2, Range, Temperature
from std_msgs.msg import ColorRGBA, Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerInit, Marker, MarkerArray

import rospy

NAN, INF = math.nan, math.inf
MESHES = {
    "many.stl": bytes(80) + struct.pack("<I", 0xFFFFFFFF),
    "cut.stl": b"solid a\nfacet normal 0 0",
    "open.stl": b"solid facet " * 500_000,
    "spaces.dae": b"<COLLADA><init_from>" + b" " * 100_000,
    "bomb.dae": b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bbbbbbbb"><!ENTITY c "'
    + b"&b;" * 1000
    + b'"><!ENTITY d "'
    + b"&c;" * 1000
    + b'">]><COLLADA><x>&d;</x></COLLADA>',
    "tree.dae": b"<COLLADA><library_nodes>"
    + b"".join(
        b'<node id="n%d"><instance_node url="#n%d"/><instance_node url="#n%d"/></node>' % (at, at + 1, at + 1)
        for at in range(40)
    )
    + b'<node id="n40"/></library_nodes></COLLADA>',
    "ring.dae": b'<COLLADA><library_nodes><node id="a"><instance_node url="#a"/></node></library_nodes>'
    b"</COLLADA>",
    "text.dae": b"no XML",
    "holes.obj": b"v nan inf 1e999\nf 1 2 4294967295\nf -9 -8 -7\n",
}
URIS = (
    "file:///etc/passwd", "file:///dev/zero.stl", "package://rviz/../../../etc/passwd.stl",
    "http://localhost/a.stl", f"package://{'a' * 3000}/a.stl", "javascript:alert(1)",
)  # fmt: skip


def robot(folder: Path) -> str:
    """Return a robot whose links are the meshes."""
    for name, content in MESHES.items():
        (folder / name).write_bytes(content)
    names = [f"file://{folder / name}" for name in MESHES]
    parts = [
        f'<link name="{Path(name).name}"><visual><geometry><mesh filename="{name}"/></geometry></visual>'
        "</link>"
        for name in names
    ]
    for number, name in enumerate(list(MESHES)[1:]):
        ends = f'<parent link="many.stl"/><child link="{name}"/>'
        parts.append(f'<joint name="{number}" type="fixed">{ends}</joint>')
    return f'<robot name="bad">{"".join(parts)}</robot>'


def pose(x: float = NAN, w: float = 1.0) -> Pose:
    made = Pose(position=Point(x, 0, 0))
    made.orientation.w = w
    return made


def markers() -> MarkerArray:
    found = []
    for number, uri in enumerate(URIS):
        each = Marker(header=Header(frame_id="map"), ns="mesh", id=number, type=Marker.MESH_RESOURCE)
        each.pose.orientation.w = each.scale.x = each.scale.y = each.scale.z = 1.0
        each.mesh_resource, each.color.a = uri, 1.0
        found.append(each)
    return MarkerArray(found)


def bad_markers() -> MarkerArray:
    """Return a marker with each mistake that rviz reports."""
    corners = [Point(x, 0, 0) for x in range(4)]
    changes: list[dict[str, Any]] = [
        {"pose": Pose()}, {"pose": pose(0.0, 0.5)}, {"pose": pose()}, {"scale": Vector3(1, 0, 1)},
        {"color": ColorRGBA(1, 1, 1, 0)}, {"type": Marker.LINE_STRIP, "scale": Vector3(), "points": corners},
        {"type": Marker.LINE_LIST, "points": corners[:3]}, {"type": Marker.LINE_LIST, "points": []},
        {"type": Marker.LINE_STRIP, "points": corners[:1]},
        {"type": Marker.POINTS, "scale": Vector3(), "points": corners},
        {"type": Marker.POINTS, "points": corners, "colors": [ColorRGBA(1, 1, 1, 1)]},
        {"type": Marker.TRIANGLE_LIST, "points": corners}, {"type": Marker.ARROW, "points": corners[:1]},
        {"type": Marker.ARROW, "points": corners[:3]}, {"type": Marker.TEXT_VIEW_FACING, "text": " "},
        {"type": Marker.TEXT_VIEW_FACING, "text": "a", "scale": Vector3()}, {"type": Marker.MESH_RESOURCE},
        {"type": Marker.CUBE_LIST}, {"type": 99}, {"action": 9}, {"header": Header(frame_id="nowhere")},
    ]  # fmt: skip
    found = []
    for number, change in enumerate(changes):
        each = Marker(header=Header(frame_id="map"), ns="bad", id=number, type=Marker.CUBE, pose=pose(0.0))
        each.scale, each.color = Vector3(1, 1, 1), ColorRGBA(1, 1, 1, 1)
        for name, value in change.items():
            setattr(each, name, value)
        found.append(each)
    return MarkerArray(found)


def messages() -> dict[str, Any]:
    header = Header(frame_id="map")
    way = Way(header=header, poses=[PoseStamped(pose=pose())])
    odometry, covariance = Odometry(header=header), PoseWithCovarianceStamped(header=header)
    odometry.pose.pose, covariance.pose.pose = pose(INF), pose(0.0)
    covariance.pose.covariance = [NAN] * 36
    polygon = PolygonStamped(header=header)
    polygon.polygon.points = [Point32(NAN, 0, 0)]
    wrench, imu = WrenchStamped(header=header), Imu(header=header)
    wrench.wrench.force.x = imu.linear_acceleration.x = NAN
    maps = [OccupancyGrid(header=header) for _ in range(2)]
    maps[1].info.width = maps[1].info.height = 4_000_000_000
    cloud = PointCloud2(header=header, width=4_000_000_000, height=4_000_000_000, point_step=16)
    marker = InteractiveMarker(header=header, name="bad", pose=pose())
    return {
        "temperature": Temperature(header, NAN, NAN),
        "path": way, "pose": PoseStamped(header=header, pose=pose(0.0, NAN)),
        "zero": PoseStamped(header=header, pose=pose(0.0, 0.0)),
        "poses": PoseArray(header=header, poses=[pose(-INF)]), "odom": odometry, "covariance": covariance,
        "polygon": polygon, "point": PointStamped(header=header, point=Point(NAN, 0, 0)),
        "cells": GridCells(header=header, cell_width=NAN, cell_height=1.0, cells=[Point(0, 0, 0)]),
        "range": Range(header=header, field_of_view=NAN, max_range=INF, range=NAN), "wrench": wrench,
        "imu": imu, "empty_map": maps[0], "huge_map": maps[1], "cloud": cloud,
        "far": PointStamped(header=header, point=Point(1e300, -1e300, 0)),
        "lost": PointStamped(header=Header(frame_id="nowhere")), "meshes": markers(),
        "markers": bad_markers(),
        "image": Image(header=header, width=4_000_000_000, height=4_000_000_000, encoding="rgb8", step=1),
        "camera_info": CameraInfo(header=header, P=[NAN] * 12),
        "controls/update_full": InteractiveMarkerInit(server_id="server", markers=[marker]),
    }  # fmt: skip


def transforms() -> TFMessage:
    """Return a transform with a zero quaternion, one with NaN, and a loop."""
    found = []
    for parent, child, x, w in (
        ("map", "flat", 0.0, 0.0),
        ("map", "nan", NAN, 1.0),
        ("one", "two", 0.0, 1.0),
        ("two", "one", 0.0, 1.0),
    ):
        each = TransformStamped(header=Header(frame_id=parent, stamp=rospy.Time.now()), child_frame_id=child)
        each.transform.translation.x, each.transform.rotation.w = x, w
        found.append(each)
    return TFMessage(found)


def main() -> None:
    rospy.init_node("bad_scene_program")
    rospy.set_param("/bad_robot", robot(Path(sys.argv[1])))
    found = messages()
    publishers = {
        name: rospy.Publisher(f"/bad/{name}", type(message), queue_size=1, latch=True)
        for name, message in found.items()
    }
    frames = rospy.Publisher("/tf", TFMessage, queue_size=1)
    for name, message in found.items():
        publishers[name].publish(message)
    rate = rospy.Rate(5)
    while not rospy.is_shutdown():
        frames.publish(transforms())
        rate.sleep()


if __name__ == "__main__":
    main()
