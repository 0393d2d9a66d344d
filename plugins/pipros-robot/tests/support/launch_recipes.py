"""Launch files for combinations of programs, and the bag that feeds them: a robot drives in a square room.

The topics of the bag start with `/bag/`, except `/tf` and `/diagnostics`. Each launch file has a namespace,
so that many can run together.
"""

import copy
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.packages.nodelets import shipped_nodelets
from pipros_robot.perception.clouds.pcd import formatted
from pipros_robot.perception.clouds.points import cloud_of
from tests.support.bags import Row
from tests.support.pictures_of_cameras import camera_info, depths, picture

SIZE = (48, 64)
START_S = 1000
SCAN, CLOUD, IMAGE = "sensor_msgs/LaserScan", "sensor_msgs/PointCloud2", "sensor_msgs/Image"
TWIST, TF, ODOMETRY = "geometry_msgs/Twist", "tf2_msgs/TFMessage", "nav_msgs/Odometry"
STATUS = "actionlib_msgs/GoalStatusArray"
LIST, ASSEMBLE = "nodelet/NodeletList", "laser_assembler/AssembleScans2"
SERVICES = (LIST, ASSEMBLE)
MANAGER, MAP_SERVER = "nodelet/nodelet", "map_server/map_server"


class Recipe(NamedTuple):
    """How a launch file starts a program.

    Attributes:
        output, type: the topic to wait for, and its type; or a service, for the types of `SERVICES`.
        remaps: pairs of names, separated by blanks.
        params: a YAML map.
    """

    output: str
    type: str
    remaps: str = ""
    params: str = "{}"
    arguments: str = ""


_STATES = Recipe("tf", TF, "/tf tf")
_FILTER = Recipe(
    "odometry/filtered", ODOMETRY, "", "{publish_tf: false, odom0: /bag/odom, odom0_config: "
    "[true, true, false, false, false, true, true, false, false, false, false, true, false, false, false]}",
)  # fmt: skip
_XYZRGB = (
    "depth_registered/image_rect /bag/camera/depth rgb/image_rect_color /bag/camera/image rgb/camera_info "
)
_STEREO = "left/image_rect /bag/camera/left left/image_rect_color /bag/camera/left left/camera_info "
_STEREO += "/bag/camera/camera_info right/image_rect /bag/camera/left right/camera_info /bag/right_info"
_COSTMAP = "robot_base_frame: base_link, transform_tolerance: 5.0, resolution: 0.1"
_NO_MAP = f"{_COSTMAP}, static_map: false, rolling_window: true, width: 4, height: 4"

RECIPES: Mapping[str, Recipe] = {
    "actionlib_tutorials/fibonacci_server": Recipe("fibonacci/status", STATUS),
    "amcl/amcl": Recipe("amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", "scan /bag/scan"),
    "depth_image_proc/convert_metric": Recipe("image", IMAGE, "image_raw /bag/camera/depth"),
    "depth_image_proc/point_cloud_xyz": Recipe("points", CLOUD, "image_rect /bag/camera/depth"),
    "depth_image_proc/point_cloud_xyzrgb": Recipe("depth_registered/points", CLOUD,
        _XYZRGB + "/bag/camera/camera_info"),
    "depth_image_proc/register": Recipe(
        "registered/image_rect", IMAGE, "depth/image_rect /bag/camera/depth depth/camera_info "
        "/bag/camera/camera_info rgb/camera_info /bag/camera/camera_info depth_registered registered",
    ),
    "depthimage_to_laserscan/depthimage_to_laserscan": Recipe("scan", SCAN,
        "image /bag/camera/depth camera_info /bag/camera/camera_info"),
    "depthimage_to_laserscan/DepthImageToLaserScanNodelet": Recipe("scan", SCAN,
        "image /bag/camera/depth camera_info /bag/camera/camera_info"),
    "diagnostic_aggregator/aggregator_node": Recipe("agg", "diagnostic_msgs/DiagnosticArray",
        "/diagnostics_agg agg", "{analyzers: {all: {type: GenericAnalyzer, path: All, contains: ['']}}}"),
    "image_proc/debayer": Recipe("image_color", IMAGE, "image_raw /bag/camera/raw"),
    "image_proc/image_proc": Recipe("image_rect_color", IMAGE,
        "image_raw /bag/camera/raw camera_info /bag/camera/camera_info"),
    "image_proc/rectify": Recipe("image_rect", IMAGE, "image_mono /bag/camera/image"),
    "image_transport/republish": Recipe("out/compressed", "sensor_msgs/CompressedImage",
        "in /bag/camera/image", arguments="raw compressed"),
    "joint_state_publisher/joint_state_publisher": Recipe("joint_states", "sensor_msgs/JointState"),
    "joy/joy_node": Recipe("joy", "sensor_msgs/Joy", params="{dev: JOYSTICK, autorepeat_rate: 5.0}"),
    "laser_assembler/laser_scan_assembler": Recipe("assemble_scans2", ASSEMBLE, "scan /bag/scan",
        "{fixed_frame: odom}"),
    "laser_filters/scan_to_cloud_filter_chain": Recipe("cloud_filtered", CLOUD, "scan /bag/scan",
        "{target_frame: laser}"),
    "laser_filters/scan_to_scan_filter_chain": Recipe(
        "scan_filtered", SCAN, "scan /bag/scan", "{scan_filter_chain: [{name: range, type: "
        "laser_filters/LaserScanRangeFilter, params: {lower_threshold: 0.3, upper_threshold: 8.0}}]}",
    ),
    MAP_SERVER: Recipe("map", "nav_msgs/OccupancyGrid", arguments="FOLDER/map.yaml"),
    "move_base/move_base": Recipe(
        "cmd_vel", TWIST, "move_base_simple/goal /bag/goal odom /bag/odom",
        "{base_local_planner: dwa_local_planner/DWAPlannerROS, controller_frequency: 3.0, "
        f"global_costmap: {{global_frame: map, {_NO_MAP}}}, "
        f"local_costmap: {{global_frame: odom, {_NO_MAP}}}}}",
    ),
    MANAGER: Recipe("~list", LIST, arguments="manager"),
    "gmapping/slam_gmapping": Recipe("map", "nav_msgs/OccupancyGrid", "scan /bag/scan",
        "{particles: 3, delta: 0.1}"),
    "pcl/CropBox": Recipe("~output", CLOUD, "~input /bag/points ~indices /bag/indices",
        "{use_indices: true}"),
    "pcl/EuclideanClusterExtraction": Recipe("~output", CLOUD, "~input /bag/points",
        "{cluster_tolerance: 2.0, spatial_locator: 1}"),
    "pcl/ExtractIndices": Recipe("~output", CLOUD, "~input /bag/points ~indices /bag/indices"),
    "pcl/PassThrough": Recipe("~output", CLOUD, "~input /bag/points"),
    "pcl/SACSegmentation": Recipe("~model", "pcl_msgs/ModelCoefficients", "~input /bag/points",
        "{model_type: 0, distance_threshold: 0.3}"),
    "pcl/StatisticalOutlierRemoval": Recipe("~output", CLOUD, "~input /bag/points",
        "{mean_k: 5, stddev: 1.0}"),
    "pcl/VoxelGrid": Recipe("~output", CLOUD, "~input /bag/points", "{leaf_size: 0.2}"),
    "pcl_ros/pcd_to_pointcloud": Recipe("cloud_pcd", CLOUD, arguments="FOLDER/map.pcd 1"),
    "pointcloud_to_laserscan/pointcloud_to_laserscan_nodelet": Recipe("scan", SCAN, "cloud_in /bag/points"),
    "robot_localization/ekf_localization_node": _FILTER,
    "robot_localization/ukf_localization_node": _FILTER,
    "robot_state_publisher/robot_state_publisher": _STATES,
    "robot_state_publisher/state_publisher": _STATES,
    "rplidar_ros/rplidarNode": Recipe("scan", SCAN, "", "{serial_port: RPLIDAR}"),
    "stage_ros/stageros": Recipe("odom", ODOMETRY, "/clock clock /tf tf", arguments="-g FOLDER/room.world"),
    "stereo_image_proc/disparity": Recipe("disparity", "stereo_msgs/DisparityImage", _STEREO),
    "stereo_image_proc/point_cloud2": Recipe("points2", CLOUD, _STEREO + " disparity /bag/disparity"),
    "stereo_image_proc/stereo_image_proc": Recipe(
        "disparity", "stereo_msgs/DisparityImage", _STEREO + " left/image_raw /bag/camera/left "
        "right/image_raw /bag/camera/left",
    ),
    "teleop_twist_joy/teleop_node": Recipe("cmd_vel", TWIST),
    "tf/static_transform_publisher": Recipe("tf", TF, "/tf tf", arguments="0 0 1 0 0 0 base_link mast 100"),
    "tf2_ros/static_transform_publisher": Recipe("tf_static", TF, "/tf_static tf_static",
        arguments="0 0 1 0 0 0 base_link mast"),
    "tf2_web_republisher/tf2_web_republisher": Recipe("~status", STATUS),
    "topic_tools/relay": Recipe("relayed", TWIST, arguments="/bag/cmd_vel relayed"),
    "topic_tools/throttle": Recipe("throttled", TWIST, arguments="messages /bag/cmd_vel 5 throttled"),
    "topic_tools/transform": Recipe(
        "speed",
        "std_msgs/Float64",
        # without --wait-for-start, it ends at once if the bag is not yet played
        arguments="--wait-for-start /bag/cmd_vel speed std_msgs/Float64 m.linear.x",
    ),
    "twist_mux/twist_mux": Recipe("cmd_vel_out", TWIST, "",
        "{topics: [{name: a, topic: /bag/cmd_vel, timeout: 2.0, priority: 9}], locks: []}"),
    "urg_node/urg_node": Recipe("scan", SCAN, "", "{ip_address: 127.0.0.1, ip_port: URG_PORT}"),
    "usb_cam/usb_cam_node": Recipe("~image_raw", IMAGE, "", "{video_device: FOLDER/video.avi, framerate: 5}"),
    "yocs_velocity_smoother/VelocitySmootherNodelet": Recipe(
        "~smooth_cmd_vel", TWIST, "~raw_cmd_vel /bag/cmd_vel", "{speed_lim_v: 0.8, speed_lim_w: 5.4, "
        "accel_lim_v: 1.0, accel_lim_w: 2.0}",
    ),
}  # fmt: skip


def _recipe(name: str, others: Collection[str]) -> Recipe:
    """Return the recipe of a program in a launch file with others, from which it may get its input."""
    one = RECIPES[name]
    if (
        name.startswith("robot_state_publisher/")
        and "joint_state_publisher/joint_state_publisher" not in others
    ):
        return one._replace(remaps=f"{one.remaps} joint_states /bag/joint_states")
    if name == "amcl/amcl" and MAP_SERVER not in others:
        return one._replace(remaps=f"{one.remaps} map /bag/map", params="{use_map_topic: true}")
    if name == "move_base/move_base" and MAP_SERVER in others:
        static = f"global_frame: map, {_COSTMAP}, static_map: true"
        return one._replace(params=one.params.replace(f"global_frame: map, {_NO_MAP}", static))
    return one


class Output(NamedTuple):
    """The output of a node in a launch file, with a full name."""

    topic: str
    type: str


def launch_file(namespace: str, programs: Sequence[str], folder: Path) -> tuple[str, list[Output]]:
    """Return a launch file that starts these programs, and the outputs of its nodes."""
    nodes, outputs = [], []
    for index, name in enumerate(programs):
        one, (package, program) = _recipe(name, programs), name.split("/")
        node, arguments = f"n{index}", one.arguments
        if name == MANAGER:
            node = "manager"
        elif name in shipped_nodelets() and package != "laser_filters":  # it has programs of these names
            arguments = f"load {name} manager" if MANAGER in programs else f"standalone {name}"
            package = program = "nodelet"
        words = one.remaps.split()
        remaps = "".join(
            f'<remap from="{old}" to="{new}"/>' for old, new in zip(words[::2], words[1::2], strict=True)
        )
        nodes.append(
            f'<node pkg="{package}" type="{program}" name="{node}" args="{arguments}">{remaps}'
            f"<rosparam>{one.params}</rosparam></node>"
        )
        outputs.append(Output(f"/{namespace}/{one.output.replace('~', f'{node}/')}", one.type))
    text = (
        "\n".join(nodes)
        .replace("FOLDER", str(folder))
        .replace("RPLIDAR", str(folder / f"{namespace}.tty"))
        .replace("JOYSTICK", str(folder / f"{namespace}.js"))
    )
    description = f'<param name="robot_description" textfile="{folder}/arm.urdf"/>'
    return f'<launch><group ns="{namespace}">{description}\n{text}\n</group></launch>\n', outputs


def moment(tenth: int) -> Iterator[tuple[str, Any]]:
    """Yield the messages of a tenth of a second, all with the same timestamp."""
    stamp = Time(START_S + tenth // 10, tenth % 10 * 10**8)

    def made(type_name: str, frame: str = "", **fields: Any) -> Any:
        message: Any = load_message_class(type_name)()
        message.header.stamp, message.header.frame_id = stamp, frame
        for name, value in fields.items():
            setattr(message, name, value)
        return message

    def image_of(array: Any, encoding: str) -> Any:
        return made(
            IMAGE, "camera", height=SIZE[0], width=SIZE[1], encoding=encoding,
            step=array.nbytes // SIZE[0], data=array.tobytes(),
        )  # fmt: skip

    x = 0.3 * math.sin(tenth / 20)
    transforms = []
    for parent, child, place in (
        ("map", "odom", 0.0), ("odom", "base_link", x),
        ("base_link", "laser", 0.1), ("base_link", "camera", 0.2),
    ):  # fmt: skip
        one = made("geometry_msgs/TransformStamped", parent, child_frame_id=child)
        one.transform.translation.x, one.transform.rotation.w = place, 1.0
        transforms.append(one)
    yield "/tf", load_message_class(TF)(transforms)
    odometry = made(ODOMETRY, "odom", child_frame_id="base_link")
    odometry.pose.pose.position.x, odometry.pose.pose.orientation.w = x, 1.0
    odometry.pose.covariance = odometry.twist.covariance = np.diag([0.01] * 6).reshape(-1).tolist()
    yield "/bag/odom", odometry
    speed: Any = load_message_class(TWIST)()
    speed.linear.x = 0.015 * math.cos(tenth / 20)
    yield "/bag/cmd_vel", speed
    if tenth % 5:
        return
    angles = -math.pi + math.radians(6) * np.arange(60)
    walls = np.minimum(4.9 / np.abs(np.cos(angles)), 4.9 / np.abs(np.sin(angles) + 1e-9))
    scan = {"angle_min": -math.pi, "angle_max": math.pi - math.radians(6), "angle_increment": math.radians(6)}
    yield "/bag/scan", made(SCAN, "laser", **scan, range_min=0.1, range_max=12.0, ranges=walls.tolist())
    yield "/bag/points", room_cloud(made("geometry_msgs/PointStamped", "laser").header)
    yield "/bag/indices", made("pcl_msgs/PointIndices", "laser", indices=list(range(0, 300, 2)))
    pictures = {
        "raw": (picture(1, SIZE), "bayer_rggb8"), "image": (picture(3, SIZE), "bgr8"),
        "depth": (depths("16UC1", SIZE), "16UC1"), "left": (picture(1, SIZE), "mono8"),
    }  # fmt: skip
    for name, (array, encoding) in pictures.items():
        yield f"/bag/camera/{name}", image_of(array, encoding)
    info = camera_info(0, size=SIZE)
    info.header.stamp = stamp
    yield "/bag/camera/camera_info", info
    right = copy.copy(info)
    right.P = [*info.P[:3], -6.0, *info.P[4:]]
    yield "/bag/right_info", right
    disparity: Any = load_message_class("stereo_msgs/DisparityImage")(header=info.header, f=50.0, T=0.1)
    disparity.image = image_of(np.full(SIZE, 2.0, np.float32), "32FC1")
    yield "/bag/disparity", disparity
    yield "/bag/joint_states", made("sensor_msgs/JointState", name=["elbow"], position=[0.1])
    status: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")(name="battery", message="full")
    yield "/diagnostics", made("diagnostic_msgs/DiagnosticArray", status=[status])
    goal = made("geometry_msgs/PoseStamped", "map")
    goal.pose.position.x, goal.pose.orientation.w = 1.2, 1.0
    yield "/bag/goal", goal
    grid = made(
        "nav_msgs/OccupancyGrid", "map", data=(room() // 255 * 100).astype(np.int8).reshape(-1).tolist()
    )
    grid.info.resolution, grid.info.width, grid.info.height, grid.info.origin.orientation.w = (
        0.1, 100, 100, 1.0
    )  # fmt: skip
    grid.info.origin.position.x = grid.info.origin.position.y = -5.0
    yield "/bag/map", grid


def room() -> Any:
    """Return a picture of the walls: 100 x 100 pixels, of which the border is 255."""
    picture_ = np.zeros((100, 100), np.uint8)
    picture_[[0, -1]] = picture_[:, [0, -1]] = 255
    return picture_


def room_cloud(header: Any) -> Any:
    """Return 300 points of the room."""
    points = np.random.default_rng(2).uniform((-4.9, -4.9, 0), (4.9, 4.9, 2), (300, 3)).astype(np.float32)
    return cloud_of(header, dict(zip("xyz", points.T, strict=True)), 16)


def rows(seconds: int) -> Iterator[Row]:
    """Yield the messages of a bag of this length."""
    for tenth in range(seconds * 10):
        for topic, message in moment(tenth):
            yield topic, message, START_S + tenth // 10, tenth % 10 * 10**8


_URDF = """<robot name="arm"><link name="arm_base"/><link name="arm"/>
<joint name="elbow" type="revolute"><parent link="arm_base"/><child link="arm"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint></robot>"""
_WORLD = """window ( size [ 200 200 ] )
model ( name "walls" bitmap "map.pgm" size [10 10 1] pose [0 0 0 0] )
position ( name "r0" pose [0 0 0 0] size [0.4 0.4 0.2] drive "diff"
  ranger ( sensor ( range [0 10] fov 180 samples 30 ) ) )
"""


def write_files(folder: Path) -> None:
    """Write the files that the launch files name: a map, its world, a robot, a cloud and a video."""
    height, width = room().shape
    (folder / "map.pgm").write_bytes(b"P5 %d %d 255\n" % (width, height) + (255 - room()).tobytes())
    (folder / "map.yaml").write_text(
        "{image: map.pgm, resolution: 0.1, origin: [-5, -5, 0], negate: 0, occupied_thresh: 0.65, "
        "free_thresh: 0.2}"
    )
    (folder / "room.world").write_text(_WORLD)
    (folder / "arm.urdf").write_text(_URDF)
    (folder / "map.pcd").write_bytes(formatted(room_cloud(load_message_class("std_msgs/Header")()), "binary"))
    writer = cv2.VideoWriter(str(folder / "video.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 5.0, SIZE[::-1])
    for _ in range(2000):
        writer.write(picture(3, SIZE))
    writer.release()
