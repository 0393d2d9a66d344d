"""`pipros_sim` in a running system: topics, time, services, parameters and the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.service_link import ServiceFailed
from pipros_libraries.pictures.pgm import write_pgm
from pipros_simulation.robots.robot_endpoints import STEERING
from tests.support.nodes import Inbox
from tests.support.page import Page
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

READY = r"Simulating \d+ robots? in a world of 10 x 8 m"


def start_sim(ros: RosSystem, *arguments: str) -> Process:
    ros.serve_master()
    sim = ros.pipros.start("rosrun", "pipros_sim", "sim", *arguments)
    sim.wait_for(READY)
    return sim


@pytest.fixture
def node(ros: RosSystem) -> Iterator[Node]:
    with Node("a_test", environment=Environment(master_uri=ros.master_uri)) as node:
        yield node


def subscribe(node: Node, topic: str, kind: str) -> Inbox:
    inbox = Inbox()
    node.subscribe(topic, load_message_class(kind), inbox)
    return inbox


def call(node: Node, service: str, kind: str, **fields: Any) -> Any:
    service_class: Any = load_service_class(kind)
    return node.client(service, service_class).call(service_class._request_class(**fields), 60)


def drive(node: Node, topic: str, linear: float, angular: float = 0.0) -> None:
    twist: Any = load_message_class("geometry_msgs/Twist")()
    twist.linear.x, twist.angular.z = linear, angular
    node.advertise(topic, type(twist), latch=True).publish(twist)


def test_one_robot_drives_and_reports_what_it_measures(ros: RosSystem, node: Node) -> None:
    sim = start_sim(ros, "_headless:=true", "_seed:=3")
    odometry = subscribe(node, "/odom", "nav_msgs/Odometry")
    truth = subscribe(node, "/base_pose_ground_truth", "nav_msgs/Odometry")
    scans = subscribe(node, "/scan", "sensor_msgs/LaserScan")
    moving, fixed = subscribe(node, "/tf", "tf2_msgs/TFMessage"), Inbox()
    node.subscribe("/tf_static", load_message_class("tf2_msgs/TFMessage"), fixed)
    battery = subscribe(node, "/battery_state", "sensor_msgs/BatteryState")
    joints = subscribe(node, "/joint_states", "sensor_msgs/JointState")
    scan = scans.wait()[0]
    odometry.wait()

    drive(node, "/cmd_vel", 0.4)  # for a second

    wait_until(lambda: odometry.messages and odometry.messages[-1].pose.pose.position.x > 0.1)
    reported = odometry.messages[-1]
    assert (reported.header.frame_id, reported.child_frame_id) == ("odom", "base_footprint")
    assert any(each.twist.twist.linear.x == pytest.approx(0.4) for each in odometry.messages)
    assert (scan.header.frame_id, len(scan.ranges), scan.angle_min) == ("base_scan", 360, 0.0)
    assert scan.ranges[180] == pytest.approx(4.9, abs=0.06)  # the wall behind the door of the built-in room
    assert [(each.header.frame_id, each.child_frame_id) for each in fixed.wait()[0].transforms] == [
        ("base_footprint", "base_link"),
        ("base_link", "base_scan"),
        ("base_link", "imu_link"),
    ]
    assert fixed.messages[0].transforms[1].transform.translation.z == 0.2
    (transform,) = moving.wait()[-1].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_footprint")
    assert joints.wait()[0].name == ["wheel_left_joint", "wheel_right_joint"]
    assert 0.9 < battery.wait()[0].percentage <= 1.0
    assert truth.wait()[0].pose.pose.orientation.w == 1.0
    sim.press_ctrl_c()
    assert sim.wait() == 0


def test_an_imu_measures_turns_and_accelerations_with_noise(ros: RosSystem, node: Node) -> None:
    start_sim(ros, "_headless:=true", "_imu:={gyro_noise: 0.001, yaw_noise: 0}", "_imu_frame:=gyro")
    measured = subscribe(node, "/imu", "sensor_msgs/Imu")
    still = measured.wait(50)[-1]
    assert (still.header.frame_id, still.linear_acceleration.z) == ("gyro", pytest.approx(9.81, abs=0.5))
    assert still.angular_velocity_covariance[8] == pytest.approx(1e-6)
    assert len({each.angular_velocity.z for each in measured.messages}) > 10

    drive(node, "/cmd_vel", 0.4, 0.5)

    wait_until(lambda: measured.messages[-1].orientation.z > 0.1)
    turning = measured.messages[-1]
    assert turning.angular_velocity.z == pytest.approx(0.5, abs=0.02)
    assert turning.linear_acceleration.y == pytest.approx(0.2, abs=0.5)  # 0.4 m/s * 0.5 rad/s
    assert max(each.linear_acceleration.x for each in measured.messages) > 10  # it starts within a step


def test_another_node_can_publish_the_transforms(ros: RosSystem, node: Node) -> None:
    start_sim(ros, "_headless:=true", "_publish_tf:=false", "_publish_static_tf:=false")
    subscribe(node, "/odom", "nav_msgs/Odometry").wait()

    assert ros.publishers("/tf") == ros.publishers("/tf_static") == []


def test_the_laser_is_where_the_robot_description_has_it(ros: RosSystem, node: Node) -> None:
    ros.serve_master()
    node.params.set(
        "robot_description",
        "<robot name='r'><link name='base_footprint'/><link name='base_link'/><link name='scanner'/>"
        "<joint name='a' type='fixed'><parent link='base_footprint'/><child link='base_link'/>"
        "<origin xyz='0 0 0.1'/></joint><joint name='b' type='fixed'><parent link='base_link'/>"
        "<child link='scanner'/><origin xyz='0.2 0 0.3' rpy='3.14159265 0 0'/></joint></robot>",
    )
    sim = ros.pipros.start(
        "rosrun", "pipros_sim", "sim", "_headless:=true", "_scan_frame:=scanner", "_laser:={noise: 0}"
    )
    sim.wait_for(READY)
    fixed = subscribe(node, "/tf_static", "tf2_msgs/TFMessage")
    scans = subscribe(node, "/scan", "sensor_msgs/LaserScan")

    scanner = fixed.wait()[0].transforms[1].transform
    assert (scanner.translation.x, scanner.translation.y, scanner.translation.z) == (0.2, 0.0, 0.3)
    assert (abs(scanner.rotation.x), abs(scanner.rotation.w)) == pytest.approx((1.0, 0.0), abs=1e-6)
    ranges = scans.wait()[0].ranges
    call(node, "/place", "pipros_sim/Place", x=0.0, y=-1.0, theta=0.0)
    wait_until(lambda: scans.messages[-1].ranges[270] == ranges[270] + 1.0)  # seen from above, the left


def test_services_place_charge_and_reset(ros: RosSystem, node: Node) -> None:
    sim = start_sim(ros, "_headless:=true")
    truth = subscribe(node, "/base_pose_ground_truth", "nav_msgs/Odometry")

    call(node, "/place", "pipros_sim/Place", x=1.0, y=-1.0, theta=1.5)
    wait_until(lambda: truth.messages and truth.messages[-1].pose.pose.position.x == 1.0)
    with pytest.raises(ServiceFailed):
        call(node, "/place", "pipros_sim/Place", x=-5.0, y=0.0)
    sim.wait_for(r"a wall or the map's edge is too close to x=-5\.00, y=0\.00")
    assert call(node, "/charge", "std_srvs/SetBool", data=True).success
    battery = subscribe(node, "/battery_state", "sensor_msgs/BatteryState")
    assert battery.wait()[0].power_supply_status in (1, 4)
    call(node, "/reset_positions", "std_srvs/Empty")
    wait_until(lambda: truth.messages[-1].pose.pose.position.x == 0.0)


@pytest.mark.parametrize("topic", ["cmd_vel", *STEERING])
def test_the_bumper_reports_walls(ros: RosSystem, node: Node, topic: str) -> None:
    start_sim(ros, "_headless:=true", "_robot:={drive: ackermann}")
    bumper = subscribe(node, "/bumper", "std_msgs/Bool")
    bumper.wait()
    call(node, "/place", "pipros_sim/Place", x=4.7, y=-3.0)

    kind = f"ackermann_msgs/{STEERING[topic]}" if topic in STEERING else "geometry_msgs/Twist"
    command: Any = load_message_class(kind)()
    if topic in STEERING:
        getattr(command, "drive", command).speed = 0.5
    else:
        command.linear.x = 0.5
    node.advertise(topic, type(command), latch=True).publish(command)

    wait_until(lambda: any(message.data for message in bumper.messages))
    assert not bumper.messages[0].data


def test_several_robots_have_their_own_names_and_frames(ros: RosSystem, node: Node) -> None:
    start_sim(ros, "_headless:=true", "_robots:=[{name: ann, x: 1, y: 1}, {name: bob, yaw: 1.0}]")
    moving = subscribe(node, "/tf", "tf2_msgs/TFMessage")
    scans = subscribe(node, "/ann/scan", "sensor_msgs/LaserScan")

    frames = [(each.header.frame_id, each.child_frame_id) for each in moving.wait()[0].transforms]
    assert frames == [("ann/odom", "ann/base_footprint"), ("bob/odom", "bob/base_footprint")]
    assert scans.wait()[0].header.frame_id == "ann/base_scan"


def test_simulated_time_is_on_the_clock_and_the_same_seed_repeats_the_scans(
    ros: RosSystem, node: Node
) -> None:
    ros.serve_master()
    node.params.set("/use_sim_time", True)
    scans = subscribe(node, "/scan", "sensor_msgs/LaserScan")
    clock = subscribe(node, "/clock", "rosgraph_msgs/Clock")
    runs: list[dict[int, Any]] = []

    def lasts(least_s: int) -> bool:
        stamps = {scan.header.stamp.to_nsec() for scan in list(scans.messages)}
        has_scans = bool(stamps & runs[0].keys() if runs else stamps)
        return has_scans and bool(clock.messages) and clock.messages[-1].clock.to_sec() > least_s

    for least_s in (40, 20):  # the first run is longer, because scans of the second may come late
        scans.messages.clear()
        clock.messages.clear()
        sim = ros.pipros.start("rosrun", "pipros_sim", "sim", "_headless:=true", "_seed:=5", "_speed:=5.0")
        sim.wait_for(READY)
        wait_until(lambda least_s=least_s: lasts(least_s))  # type: ignore[misc]
        sim.press_ctrl_c()
        assert sim.wait() == 0
        runs.append({scan.header.stamp.to_nsec(): scan.ranges for scan in scans.messages})
    assert all(stamp % 100_000_000 == 0 for stamp in runs[0])
    common = runs[0].keys() & runs[1].keys()
    assert common
    assert all(runs[0][stamp] == runs[1][stamp] for stamp in common)


@pytest.mark.parametrize(("argument", "why"), [
    ("_robots:=0", "robots must be a number from 1 to 100, or a list, got 0"),
    ("_robots:=[{size: 3}]", "each robot must be a mapping of name, x, y and yaw only"),
    (
        "_robots:=[{name: a b}]",
        r"a robot's name must begin with a letter and contain only letters, digits and _, got 'a b'",
    ),
    ("_robots:=[]", "robots must be a list of 1 to 100 robots, got 0"),
    ("_laser:={rays: 0}", "laser/rays must be > 0, got 0|laser/rays must be 1 to 10000, got 0"),
    ("_obstacles:=5", r"obstacles must be a list of at most 100 mappings, got 5"),
    ("_obstacles:=[{points: 1}]", r"obstacles/points must be a list of \[x, y\], got 1"),
    (
        "_obstacles:=[{size: 1}]",
        r"an obstacle must be a mapping with points, and optionally radius and speed",
    ),
    ("_speed:=2.0", r"speed 2\.0 needs simulated time: set /use_sim_time to true first"),
    ("_robots:=[{name: ann", r"robots must be YAML: robots:"),
    ("_speed:=0", r"seed must be >= 0 and speed > 0, got 0 and 0"),
    ("_map:=/missing.yaml", r"/missing\.yaml"),
])  # fmt: skip
def test_invalid_parameters_end_the_program_with_their_name(ros: RosSystem, argument: str, why: str) -> None:
    ros.serve_master()
    sim = ros.pipros.run("rosrun", "pipros_sim", "sim", "_headless:=true", argument)
    assert sim.returncode == 1
    sim.wait_for(why)


def test_the_page_shows_moves_and_steers_its_own_robots(ros: RosSystem) -> None:
    sim = start_sim(ros)
    page = Page.of(sim)
    assert b"Robots" in page.get("/").read()
    assert page.get("/live.js").status == 200
    with page.connect() as browser:
        views = browser.watch("world")
        first = next(views)
        assert first["walls"].startswith("iVBORw0KGgo")  # the magic bytes of PNG
        assert first["area"] == [-5.0, -4.0, 10.0, 8.0]
        (robot,) = next(views)["robots"]
        assert (robot["pose"], len(robot["points"])) == ([0.0, 0.0, 0.0], 180)
        assert browser.act("place", robot="", x=1.0, y=2.0, yaw=1.0) is None
        wait_until(lambda: next(views)["robots"][0]["pose"] == [1.0, 2.0, 1.0])
        assert (
            "a wall or the map's edge is too close"
            in browser.act("place", robot="", x=-5.0, y=0.0, yaw=0.0)["error"]
        )
        assert "error" in browser.act("place", robot="", x=None, y=0.0, yaw=0.0)
        assert browser.act("steer", robot="", linear=0.3, angular=0.0) is None
        assert "error" in browser.act("steer", robot="c", linear=0.3, angular=0.0)
        wait_until(lambda: next(views)["robots"][0]["pose"][1] > 2.05)
        assert browser.act("reset") is None
        wait_until(lambda: next(views)["robots"][0]["pose"] == [0.0, 0.0, 0.0])
        assert ros.publishers("/cmd_vel") == []
        assert browser.act("close") is None
    assert sim.wait() == 0


def test_fake_localization_publishes_the_true_pose_as_amcl_would(ros: RosSystem, node: Node) -> None:
    start_sim(ros, "_headless:=true", "_robot:={odometry_noise: 0.2}")
    ros.pipros.start("rosrun", "fake_localization", "fake_localization", "_base_frame_id:=base_footprint")
    ros.wait_for_publisher("/amcl_pose")
    truth = subscribe(node, "/base_pose_ground_truth", "nav_msgs/Odometry")
    estimates = subscribe(node, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped")
    transforms = subscribe(node, "/tf", "tf2_msgs/TFMessage")
    cloud = subscribe(node, "/particlecloud", "geometry_msgs/PoseArray")
    call(node, "/place", "pipros_sim/Place", x=1.0, y=2.0, theta=0.5)
    drive(node, "/cmd_vel", 0.2, 0.3)

    def pairs() -> list[tuple[Any, Any]]:
        poses = {each.header.stamp.to_nsec(): each.pose.pose for each in list(truth.messages)}
        return [
            (poses[stamp], each.pose.pose)
            for each in list(estimates.messages)
            if (stamp := each.header.stamp.to_nsec()) in poses and each.pose.pose.position.x > 1.1
        ]

    wait_until(lambda: len(pairs()) > 3)
    assert all(true == estimated for true, estimated in pairs())
    assert (estimates.messages[0].header.frame_id, len(cloud.wait()[0].poses)) == ("map", 1)
    wait_until(
        lambda: any(
            (each.header.frame_id, each.child_frame_id) == ("map", "odom")
            for message in list(transforms.messages)
            for each in message.transforms
        )
    )


def test_an_initial_pose_shifts_the_fake_localization(ros: RosSystem, node: Node) -> None:
    start_sim(ros, "_headless:=true")
    ros.pipros.start("rosrun", "fake_localization", "fake_localization")
    estimates = subscribe(node, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped")
    estimates.wait()
    initial: Any = load_message_class("geometry_msgs/PoseWithCovarianceStamped")()
    initial.header.frame_id, initial.pose.pose.position.x = "map", 3.0
    initial.pose.pose.orientation.w = 1.0

    node.advertise("/initialpose", type(initial), latch=True).publish(initial)

    wait_until(lambda: estimates.messages[-1].pose.pose.position.x == 3.0)


def test_turtlebot3_fake_follows_cmd_vel(ros: RosSystem, node: Node) -> None:
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", "turtlebot3_fake", "turtlebot3_fake.launch", "model:=waffle_pi")
    launched.wait_for("Simulating 1 robot ")
    odometry = subscribe(node, "/odom", "nav_msgs/Odometry")
    odometry.wait()

    drive(node, "/cmd_vel", 1.0)

    wait_until(lambda: any(each.twist.twist.linear.x == pytest.approx(0.26) for each in odometry.messages))
    launched.press_ctrl_c()
    assert launched.wait() == 0


def test_a_package_of_a_workspace_takes_precedence(ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "turtlebot3_fake").mkdir()
    (tmp_path / "turtlebot3_fake" / "package.xml").write_text(
        "<package><name>turtlebot3_fake</name><version>1.0.0</version><description>mine</description>"
        "<maintainer email='a@example.org'>a</maintainer><license>x</license></package>"
    )
    found = ros.pipros.run("rospack", "find", "turtlebot3_fake", ROS_PACKAGE_PATH=str(tmp_path))
    assert found.stdout == [str(tmp_path / "turtlebot3_fake")]


def test_the_launch_file_takes_a_list_of_robots(ros: RosSystem, node: Node) -> None:
    ros.pipros.start_master()
    robots = "robots:=[{name: ann, x: 1, y: 1}, {name: bob, x: 3, y: 1}]"
    launched = ros.pipros.start("roslaunch", "pipros_sim", "sim.launch", "headless:=true", robots)
    truth = subscribe(node, "/bob/base_pose_ground_truth", "nav_msgs/Odometry")
    place = truth.wait()[0].pose.pose.position
    assert (place.x, place.y) == (3.0, 1.0)
    launched.press_ctrl_c()
    assert launched.wait() == 0


def test_the_launch_file_with_localisation_brings_map_and_transforms(ros: RosSystem, node: Node) -> None:
    ros.pipros.start_master()
    launched = ros.pipros.start("roslaunch", "pipros_sim", "localized.launch", "headless:=true")
    grids = subscribe(node, "/map", "nav_msgs/OccupancyGrid")
    assert grids.wait()[0].info.width == 200
    estimates = subscribe(node, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped")
    assert 0 < estimates.wait()[0].header.stamp.to_sec() < 1000  # simulated time
    launched.press_ctrl_c()
    assert launched.wait() == 0


def test_stageros_runs_a_world_with_a_bitmap(ros: RosSystem, node: Node, tmp_path: Path) -> None:
    pixels = np.full((100, 100), 255, np.uint8)
    pixels[[0, -1]] = pixels[:, [0, -1]] = 0
    (tmp_path / "room.pgm").write_bytes(write_pgm(100, 100, pixels.tobytes(), "a room"))
    (tmp_path / "room.world").write_text(
        'model ( bitmap "room.pgm" size [10 10 1] )\n'
        'define rover position ( size [0.4 0.4 0.2] drive "omni" watts 9\n'
        ' localization "gps" localization_origin [0 0 0 0]\n'
        "  ranger ( pose [0 0 0.05 0] sensor ( range [0 30] fov 180 samples 181 ) ) )\n"
        "rover ( pose [1 0 0 90] ) rover ( pose [-3 0 0 0] )\n"
    )
    ros.serve_master()
    stage = ros.pipros.start("rosrun", "stage_ros", "stageros", "-g", tmp_path / "room.world")
    scans = subscribe(node, "/robot_0/base_scan", "sensor_msgs/LaserScan")
    scan = scans.wait()[0]
    assert (scan.header.frame_id, len(scan.ranges)) == ("robot_0/base_laser_link", 181)
    assert (scan.ranges[0], scan.ranges[90]) == (pytest.approx(3.9), pytest.approx(4.9))
    assert scan.ranges[180] == pytest.approx(3.8)  # the other robot
    assert "http" not in stage.output
    fixed = subscribe(node, "/tf_static", "tf2_msgs/TFMessage").wait()[0]
    heights = {each.child_frame_id: each.transform.translation.z for each in fixed.transforms}
    assert heights["robot_1/base_laser_link"] == pytest.approx(0.25)  # the robot's height and the scanner's z
    odometry = subscribe(node, "/robot_1/odom", "nav_msgs/Odometry").wait()[0].pose.pose.position
    assert (odometry.x, odometry.y) == (-3.0, 0.0)
    assert stage.output.count("watts of a position has no effect") == 1
    stage.press_ctrl_c()
    assert stage.wait() == 0


def test_stageros_without_a_world_prints_its_usage(ros: RosSystem) -> None:
    ended = ros.pipros.run("rosrun", "stage_ros", "stageros")
    assert ended.returncode == 255
    assert "USAGE: stageros" in ended.output


@pytest.mark.parametrize(
    "program", [("pipros_sim", "sim"), ("stage_ros", "stageros"), ("turtlebot3_fake", "turtlebot3_fake_node")]
)
def test_without_numpy_one_line_names_the_command_that_installs_it(
    ros: RosSystem, tmp_path: Path, program: tuple[str, str]
) -> None:
    (tmp_path / "numpy.py").write_text("raise ModuleNotFoundError(name='numpy')\n")
    ended = ros.pipros.run("rosrun", *program, PYTHONPATH=str(tmp_path))
    assert ended.returncode == 1
    (line,) = ended.output.splitlines()
    assert line.startswith("ERROR: the robot simulator needs numpy, which is not installed. Try: ")
