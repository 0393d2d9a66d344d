"""A robot, a map and sensors at known places, for the Scene tab: a static system, published once a second."""

from __future__ import annotations

import math
import pathlib
import struct

from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    Wrench,
    WrenchStamped,
)
from nav_msgs.msg import GridCells, OccupancyGrid, Odometry, Path
from sensor_msgs.msg import (
    CameraInfo,
    ChannelFloat32,
    FluidPressure,
    Illuminance,
    Image,
    Imu,
    LaserScan,
    PointCloud,
    PointCloud2,
    PointField,
    Range,
    RelativeHumidity,
    Temperature,
)
from std_msgs.msg import Header
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, Marker, MarkerArray, MenuEntry

import rospy
import tf2_ros
from interactive_markers.interactive_marker_server import InteractiveMarkerServer

ROBOT = """<robot name="r">
<link name="base_link"><visual><geometry><box size="1 1 1"/></geometry>
<material name="m"><color rgba="0.8 0.4 0.2 1"/></material></visual></link>
<link name="bare"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
<link name="lost"><visual><origin xyz="0 -4 0"/><geometry><box size="1 1 1"/></geometry></visual></link>
<joint name="a" type="fixed"><parent link="base_link"/><child link="bare"/></joint>
<joint name="b" type="fixed"><parent link="base_link"/><child link="lost"/></joint>
</robot>"""


MESHES = pathlib.Path(__file__).resolve().parent / "meshes"


def mesh_robot() -> str:
    """Return a robot of meshes: one row without materials, and one row with the same URDF material."""
    links = []
    for row, material in enumerate(("", '<material name="m"><color rgba="0.9 0.6 0.1 1"/></material>')):
        for column, name in enumerate(("wedge.stl", "wedge.obj", "wedge_z.dae", "wedge_y.dae")):
            mesh = f'<geometry><mesh filename="file://{MESHES / name}"/></geometry>'
            place = f'<origin xyz="{4 * column - 8} {4 * row - 3} 0" rpy="0 0 0.3"/>'
            links.append(f"<visual>{place}{mesh}{material}</visual>")
    return f'<robot name="meshes"><link name="map">{"".join(links)}</link></robot>'


def transform(parent: str, child: str, x: float, y: float) -> TransformStamped:
    made = TransformStamped(header=Header(frame_id=parent), child_frame_id=child)
    made.transform.translation.x, made.transform.translation.y = x, y
    made.transform.rotation.w = 1.0
    return made


def pose_at(x: float, y: float, yaw: float = 0.0) -> Pose:
    made = Pose(position=Point(x, y, 0.0))
    made.orientation.z, made.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return made


def poses() -> dict[str, object]:
    header = Header(frame_id="map")
    odometry = Odometry(header=header, child_frame_id="base_link")
    odometry.pose.pose = pose_at(0, 0, 0.5)
    covariance = PoseWithCovarianceStamped(header=header)
    covariance.pose.pose = pose_at(0, 0, 0.5)
    for each in (odometry.pose, covariance.pose):
        each.covariance = [0.0] * 36
        each.covariance[0], each.covariance[7], each.covariance[35] = 1.0, 0.25, 0.1
        each.covariance[1] = each.covariance[6] = 0.2
    solid = PoseWithCovarianceStamped(header=header)
    solid.pose.pose = pose_at(0, 0, 0.5)
    solid.pose.covariance = [0.0] * 36
    for number, value in ((0, 1.0), (7, 0.25), (14, 0.5), (21, 0.05), (28, 0.1), (35, 0.2)):
        solid.pose.covariance[number] = value
    solid.pose.covariance[29] = solid.pose.covariance[34] = 0.08
    polygon = PolygonStamped(header=header)
    polygon.polygon.points = [Point32(-3, -3, 0), Point32(3, -3, 0), Point32(0, 3, 0)]
    cells = GridCells(header=header, cell_width=1.0, cell_height=0.5)
    cells.cells = [Point(-3, -2, 0), Point(1, 1, 0)]
    reach = Range(header=header, field_of_view=0.8, min_range=0.1, max_range=9.0, range=4.0)
    return {
        "pose": PoseStamped(header=header, pose=pose_at(-1, -1, 0.7)),
        "poses": PoseArray(header=header, poses=[pose_at(-2, 0, 1.0), pose_at(1, 0), pose_at(1, 2, -2.0)]),
        "odom": odometry, "covariance": covariance, "covariance_3d": solid, "polygon": polygon,
        "point": PointStamped(header=header, point=Point(1, 2, 0)), "range": reach, "cells": cells,
        "wrench": WrenchStamped(header=header, wrench=Wrench(Vector3(-1, 0.5, 0), Vector3(0.3, 0.4, 2))),
    }  # fmt: skip


SPOTS = (
    (Temperature, "map", 30), (FluidPressure, "base_link", 99000), (Illuminance, "bare", 800),
    (RelativeHumidity, "turned", 0.1),
)  # fmt: skip
"""Sensors of a single number, in different frames."""


def marker(number: int, kind: int, x: float, y: float, sizes: tuple[float, float, float]) -> Marker:
    made = Marker(header=Header(frame_id="map"), ns="shapes", id=number, type=kind, pose=pose_at(x, y, 0.4))
    made.scale.x, made.scale.y, made.scale.z = sizes
    made.color.r, made.color.g, made.color.b, made.color.a = 1.0, 0.6, 0.2, 1.0
    return made


def shapes() -> MarkerArray:
    """Return a marker of most types, in rows."""
    corners = [Point(0, 0, 0), Point(1.5, 0, 0), Point(1.5, 1, 0), Point(0, 1, 0)]
    found = [
        marker(0, Marker.ARROW, -7, 3, (2.0, 0.5, 0.5)), marker(1, Marker.CUBE, -3, 3, (1.5, 1.0, 0.5)),
        marker(2, Marker.SPHERE, 0, 3, (2.0, 1.0, 1.0)), marker(3, Marker.CYLINDER, 3, 3, (1.5, 1.0, 1.0)),
        marker(4, Marker.LINE_STRIP, -7, 0, (0.3, 0.0, 0.0)),
        marker(5, Marker.LINE_LIST, -3, 0, (0.3, 0.0, 0.0)),
        marker(6, Marker.CUBE_LIST, 0, 0, (0.6, 0.6, 0.6)),
        marker(7, Marker.SPHERE_LIST, 3, 0, (0.6, 0.6, 0.6)),
        marker(8, Marker.POINTS, -7, -3, (0.5, 0.5, 0.0)),
        marker(11, Marker.TRIANGLE_LIST, -3, -3, (1.0, 1.0, 1.0)),
        marker(12, Marker.ARROW, 0, -3, (0.3, 0.8, 0.5)),
    ]  # fmt: skip
    for each in found[4:]:
        each.points = corners
    found[9].points = corners[:3]
    found[10].points = corners[::2]
    found[1].color.a = 0.5
    return MarkerArray(found)


def cameras() -> dict[str, object]:
    """Return messages from a camera 5 m above the origin that looks down, and from an inertial sensor."""
    header = Header(frame_id="camera")
    depth = Image(header=header, width=4, height=4, encoding="16UC1", step=8)
    depth.data = struct.pack("<16H", *[5000] * 15, 0)
    colour = Image(header=header, width=4, height=4, encoding="rgb8", step=12, data=bytes([200, 100, 0] * 16))
    info = CameraInfo(header=header, width=4, height=4)
    info.P = [2.0, 0, 2.0, 0, 0, 2.0, 2.0, 0, 0, 0, 1.0, 0]
    large = Image(
        header=header, width=40, height=40, encoding="rgb8", step=120, data=bytes([200, 100, 0] * 1600)
    )
    large_info = CameraInfo(header=header, width=40, height=40)
    large_info.P = [20.0, 0, 20.0, 0, 0, 20.0, 20.0, 0, 0, 0, 1.0, 0]
    wide = Image(header=header, width=160, height=160, encoding="rgb8", step=480)
    wide.data = bytes([200, 100, 0] * 80 + [0, 100, 200] * 80) * 160
    wide_info = CameraInfo(header=header, width=160, height=160)
    wide_info.P = [50.0, 0, 80.0, 0, 0, 50.0, 80.0, 0, 0, 0, 1.0, 0]
    imu = Imu(header=Header(frame_id="map"))
    imu.orientation.w = 1.0
    imu.linear_acceleration.x = 4.0
    return {
        "depth/image": depth, "depth/camera_info": info, "colour/image": colour, "camera/image": large,
        "camera/camera_info": large_info, "wide/image": wide, "wide/camera_info": wide_info, "imu": imu,
    }  # fmt: skip


def pictures() -> dict[str, object]:
    """Return images of 8 x 6 fields of 5 x 5 pixels, with colours, 16-bit numbers and floats."""
    fields = [(x // 5, y // 5) for y in range(30) for x in range(40)]
    made = {}
    for name, encoding, size, data in (
        ("picture", "rgb8", 3, bytes(part for x, y in fields for part in (30 * x, 40 * y, 100))),
        ("picture_16", "16UC1", 2, b"".join(struct.pack("<H", 1000 + 400 * x + 50 * y) for x, y in fields)),
        ("picture_32", "32FC1", 4, b"".join(struct.pack("<f", 0.5 * x + 0.1 * y) for x, y in fields)),
    ):
        made[name] = Image(Header(frame_id="camera"), 30, 40, encoding, 0, 40 * size, data)
    return made


def interactive() -> InteractiveMarker:
    """Return a marker that moves along x, and has a menu and a button."""
    made = InteractiveMarker(header=Header(frame_id="map"), name="box", scale=4.0, pose=pose_at(-3, -1))
    made.menu_entries = [MenuEntry(id=1, title="First"), MenuEntry(id=2, title="[x] Second")]
    for name, mode, orientation in (
        ("move_x", InteractiveMarkerControl.MOVE_AXIS, (0.0, 0.0, 0.0, 1.0)),
        ("press", InteractiveMarkerControl.BUTTON, (0.0, 0.0, 0.0, 1.0)),
    ):
        control = InteractiveMarkerControl(name=name, interaction_mode=mode, always_visible=True)
        control.orientation = Quaternion(*orientation)
        made.controls.append(control)
    cube = Marker(type=Marker.CUBE, pose=pose_at(0, 0))
    cube.scale.x = cube.scale.y = cube.scale.z = 1.0
    cube.color.b = cube.color.a = 1.0
    made.controls[1].markers.append(cube)
    return made


def main() -> None:
    rospy.init_node("scene_program")
    rospy.set_param("/robot_description", ROBOT)
    rospy.set_param("/meshes", mesh_robot())
    rospy.set_param("/empty_robot", "")
    frames = tf2_ros.StaticTransformBroadcaster()
    camera = transform("map", "camera", 0, 0)
    camera.transform.translation.z, camera.transform.rotation.x, camera.transform.rotation.w = 5.0, 1.0, 0.0
    turned = transform("map", "turned", -1, 1)
    turned.transform.rotation.z, turned.transform.rotation.w = math.sin(0.4), math.cos(0.4)
    fixed = [transform("map", "base_link", 2, 2), transform("map", "bare", 4, 2), camera, turned]
    frames.sendTransform(fixed)
    grid = OccupancyGrid(header=Header(frame_id="map"))
    grid.info.resolution, grid.info.width, grid.info.height = 1.0, 3, 1
    grid.info.origin.position.x, grid.info.origin.position.y = -4.0, 2.0
    grid.info.origin.orientation.w = 1.0
    grid.data = [0, 100, -1]
    floor = OccupancyGrid(header=Header(frame_id="map"))
    floor.info.resolution, floor.info.width, floor.info.height = 1.0, 12, 10
    floor.info.origin.position.x, floor.info.origin.position.y = -6.0, -5.0
    floor.info.origin.orientation.w = 1.0
    floor.data = [0, 0, 0, 0, 100, 100, 0, 0, 30, 0, -1, -1] * 10
    plan = Path(header=Header(frame_id="map"))
    plan.poses = [PoseStamped(pose=pose_at(x, y)) for x, y in ((-5, -4), (-4, 2), (5, 4))]
    path = Path(header=Header(frame_id="map"))
    for x in (-4.0, -1.0):
        pose = PoseStamped()
        pose.pose = pose_at(x, -2.0, 0.8 * x)
        pose.pose.position.z = 0.5
        path.poses.append(pose)
    fields = [
        PointField(name, offset, 7, 1) for name, offset in (("x", 0), ("y", 4), ("z", 8), ("intensity", 12))
    ]
    points = [(-4, 0, 0, 0), (-3, 0, 0, 50), (-2, 0, 0, 100), (float("nan"), 0, 0, 1000)]
    cloud = PointCloud2(height=1, width=4, point_step=16, row_step=64, fields=fields)
    cloud.header.frame_id = "map"
    cloud.data = b"".join(struct.pack("<4f", *point) for point in points)
    fields = [PointField(name, offset, 7, 1) for name, offset in (("x", 0), ("y", 4), ("z", 8), ("rgb", 12))]
    tints = [(-4, 0, 0, 0xC86432), (-3, 1, 0, 0x00FF00), (2, 0, 0, 0x0A141E)]
    coloured = PointCloud2(height=1, width=3, point_step=16, row_step=48, fields=fields)
    coloured.header.frame_id = "map"
    coloured.data = b"".join(struct.pack("<3fI", *point) for point in tints)
    old = PointCloud(header=Header(frame_id="map"), points=[Point32(x, 1, 0) for x in (-3, -1, 1)])
    old.channels = [ChannelFloat32("heat", [10, 20, 40])]
    scan = LaserScan(header=Header(frame_id="base_link"), range_min=0.5, range_max=9.0, angle_increment=1.0)
    scan.ranges = [3.0, 0.1]
    cube = Marker(header=Header(frame_id="map"), ns="cubes", id=1, type=Marker.CUBE)
    cube.pose.position.x, cube.pose.position.y, cube.pose.orientation.w = 0.0, 4.0, 1.0
    cube.scale.x = cube.scale.y = cube.scale.z = 1.0
    cube.color.g = cube.color.a = 1.0
    spheres = Marker(header=Header(frame_id="map"), ns="spheres", id=1, type=Marker.SPHERE_LIST)
    spheres.pose.orientation.w = 1.0
    spheres.scale.x = spheres.scale.y = spheres.scale.z = 0.8
    spheres.points = [Point(2.0, 4.0, 0.0), Point(3.0, 4.0, 0.0)]
    spheres.color.r = spheres.color.a = 1.0
    messages = {
        "map": grid, "floor": floor, "plan": plan, "path": path, "cloud": cloud, "scan": scan,
        "visualization_marker": cube,
    }  # fmt: skip
    messages |= {"markers": MarkerArray([spheres]), "rgb_cloud": coloured, "old_cloud": old}
    messages |= poses() | cameras() | pictures() | {"shapes": shapes()}
    messages |= {kind.__name__: kind(Header(frame_id=frame), value, 0) for kind, frame, value in SPOTS}
    publishers = {
        name: rospy.Publisher(f"/{name}", type(message), queue_size=1, latch=True)
        for name, message in messages.items()
    }
    server = InteractiveMarkerServer("controls")
    server.insert(interactive(), lambda _: None)
    for name, x, y in (("MOVE_ROTATE", 5, 2), ("MOVE_PLANE", 5, -3), ("ROTATE_AXIS", -4, 3.5)):
        flat = InteractiveMarker(header=Header(frame_id="map"), name=name, scale=3.0, pose=pose_at(x, y))
        mode = getattr(InteractiveMarkerControl, name)
        control = InteractiveMarkerControl(name=name, interaction_mode=mode, always_visible=True)
        control.orientation = Quaternion(0, 1, 0, 1)
        flat.controls.append(control)
        server.insert(flat, lambda _: None)
    server.applyChanges()
    rate = rospy.Rate(2)
    while not rospy.is_shutdown():
        for name, message in messages.items():
            publishers[name].publish(message)
        rate.sleep()


if __name__ == "__main__":
    main()
