"""The packages in the wiki's tutorials, as typed: talkers, services, actions, followers."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_simulation.turtlesim.turtle import TICK_S
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Pose: Any = load_message_class("turtlesim/Pose")
Twist: Any = load_message_class("geometry_msgs/Twist")


def start_turtlesim(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start("rosrun", "turtlesim", "turtlesim_node", "_headless:=true")
    ros.wait_for_subscriber("/turtle1/cmd_vel")


def test_talkers_and_listeners_of_both_languages_understand_each_other(ros: RosSystem) -> None:
    ros.serve_master()
    in_cpp = ros.pipros.start("rosrun", "roscpp_tutorials", "listener", "__name:=cpp_listener")
    in_python = ros.pipros.start("rosrun", "rospy_tutorials", "listener.py")
    ros.pipros.start("rosrun", "roscpp_tutorials", "talker", "__name:=cpp").wait_for(
        r"\[ INFO\] \[\d+\.\d{9}\]: hello world \d+"
    )
    ros.pipros.start("rosrun", "rospy_tutorials", "talker.py").wait_for(r"\[INFO\] .*: hello world \d+\.\d+")
    in_cpp.wait_for(r"\[ INFO\] \[\d+\.\d{9}\]: I heard: \[hello world \d+\]")
    in_cpp.wait_for(r"I heard: \[hello world \d+\.\d+\]")
    in_python.wait_for(r"\[INFO\] \[\d+\.\d{6}\]: /listener_\d+_\d+I heard hello world \d+$")


@pytest.mark.parametrize("package", ["rospy_tutorials", "roscpp_tutorials"])
def test_the_launch_files_start_a_talker_and_a_listener(ros: RosSystem, package: str) -> None:
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", package, "talker_listener.launch")
    launched.wait_for("I heard")
    launched.press_ctrl_c()
    assert launched.wait() == 0


def test_numbers_are_added(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("rosrun", "rospy_tutorials", "add_two_ints_server", PYTHONUNBUFFERED="1")
    ended = ros.pipros.run("rosrun", "rospy_tutorials", "add_two_ints_client", "3", "4")
    assert ended.stdout == ["Requesting 3+4", "3 + 4 = 7"]
    server.wait_for(r"Returning \[3 \+ 4 = 7\]")
    server.press_ctrl_c()
    server.wait()
    server = ros.pipros.start("rosrun", "roscpp_tutorials", "add_two_ints_server")
    wait_until(
        lambda: "/add_two_ints" in ros.pipros.run("rosservice", "find", "roscpp_tutorials/TwoInts").stdout,
        30,
        "a server",
    )
    added = ros.pipros.run("rosrun", "roscpp_tutorials", "add_two_ints_client", "3", "4")
    assert (added.returncode, added.output.rpartition(": ")[2].strip()) == (0, "7")
    server.wait_for(r"request: x=3, y=4")
    server.wait_for(r"  sending back response: \[7\]")
    assert ros.pipros.run("rosrun", "roscpp_tutorials", "add_two_ints_client", "3").returncode == 1


def test_parameters_are_read_set_deleted_and_found(ros: RosSystem) -> None:
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", "rospy_tutorials", "param_talker.launch")
    for line in (
        "/global_example is global value", "/foo/utterance is Hello World",
        "/foo/param_talker/topic_name is chatter", "/foo/default_param is default_value",
        r"gains are 1\.0, 2\.0, 3\.0", "found global_example parameter under key: /global_example",
        "Hello World",
    ):  # fmt: skip
        launched.wait_for(line)
    assert ros.pipros.run("rosparam", "get", "/foo/param_talker/private_bar").stdout == ["3"]


def test_a_short_fibonacci_sequence_and_an_average(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start("rosrun", "actionlib_tutorials", "fibonacci_server.py")
    ros.wait_for_subscriber("/fibonacci/goal")
    goal = ["rostopic", "pub", "-1", "/fibonacci/goal", "actionlib_tutorials/FibonacciActionGoal"]
    result = ros.pipros.start("rostopic", "echo", "-n1", "/fibonacci/result/result/sequence")
    wait_until(
        lambda: " * topic: /fibonacci/result" in ros.pipros.run("rosnode", "info", "/fibonacci").stdout,
        what="the connection for the result",
    )
    ros.pipros.start(*goal, "{goal: {order: 2}}")
    result.wait_for(r"\[0, 1, 1\]")
    ros.pipros.start("rosrun", "actionlib_tutorials", "averaging_server")
    ros.pipros.start("rosrun", "actionlib_tutorials", "gen_numbers.py").wait_for("Generating random numbers")
    client = ros.pipros.start("rosrun", "actionlib_tutorials", "averaging_client")
    client.wait_for("Action server started, sending goal.")
    client.wait_for("Action finished: (SUCCEEDED|ABORTED)")


def test_the_fibonacci_server_of_roscpp_has_an_action_of_that_name_whatever_the_node_is(
    ros: RosSystem,
) -> None:
    ros.serve_master()
    ros.pipros.start("rosrun", "actionlib_tutorials", "fibonacci_server", "__name:=other")
    ros.wait_for_subscriber("/fibonacci/goal")
    assert ros.subscribers("/fibonacci/goal") == ["/other"]


def test_a_client_of_actions_ends_with_one_line_after_ctrl_c(ros: RosSystem) -> None:
    ros.serve_master()
    client = ros.pipros.start("rosrun", "actionlib_tutorials", "fibonacci_client.py")
    ros.wait_for_subscriber("/fibonacci/feedback")  # the last one
    client.press_ctrl_c()
    assert client.wait() == 1
    assert client.output.splitlines()[-1].endswith("program interrupted before completion")
    assert "Traceback" not in client.output


def corners_and_turns(poses: list[Any]) -> list[tuple[float, float]]:
    """Return the length of each edge, and the angle that the turtle turned at its end."""
    edges: list[tuple[float, float]] = []
    start, is_turning = poses[0], False
    for before, now in itertools.pairwise(poses):
        if now.linear_velocity > 0 and is_turning:
            turned = math.remainder(before.theta - start.theta, math.tau)
            edges.append((math.hypot(before.x - start.x, before.y - start.y), turned))
            start, is_turning = before, False
        is_turning = is_turning or now.angular_velocity != 0
    turned = math.remainder(poses[-1].theta - start.theta, math.tau)
    return [*edges, (math.hypot(poses[-1].x - start.x, poses[-1].y - start.y), turned)]


@pytest.mark.timeout(240)
def test_a_turtle_draws_a_pentagon_exactly(ros: RosSystem) -> None:
    """The turtle of this test moves once for each command, so that it never moves while a node is paused."""
    ros.serve_master()
    poses = [Pose(x=5.5, y=5.5)]
    polls, seen = itertools.count(), 0
    with Node("turtle", environment=Environment(master_uri=ros.master_uri)) as node:

        def move(twist: Any) -> None:
            theta = poses[-1].theta + twist.angular.z * TICK_S
            x = poses[-1].x + math.cos(theta) * twist.linear.x * TICK_S
            y = poses[-1].y + math.sin(theta) * twist.linear.x * TICK_S
            poses.append(Pose(x, y, theta, twist.linear.x, twist.angular.z))
            publisher.publish(poses[-1])

        def is_finished() -> bool:
            nonlocal seen
            if next(polls) % 100 == 0:  # about once a second
                if seen == len(poses):  # the server has no goal yet
                    publisher.publish(poses[-1])
                seen = len(poses)
            return "Action finished: SUCCEEDED" in client.output

        publisher = node.advertise("/turtle1/pose", Pose)
        node.subscribe("/turtle1/cmd_vel", Twist, move)
        server = ros.pipros.start("rosrun", "turtle_actionlib", "shape_server")
        client = ros.pipros.start("rosrun", "turtle_actionlib", "shape_client")
        wait_until(is_finished, 120, lambda: f"{poses[-1]}\n{client.output}")
        server.wait_for("turtle_shape: Succeeded")
    edges = corners_and_turns(poses)
    apothem = 1.3 * math.cos(math.pi / 5)
    assert [length for length, _ in edges] == pytest.approx(
        [2 * apothem * math.tan(math.pi / 5)] * 5, abs=0.01
    )
    assert [turn for _, turn in edges] == pytest.approx([math.tau / 5] * 5, abs=1e-4)


@pytest.mark.parametrize(("package", "launch"), [
    ("turtle_tf", "turtle_tf_demo.launch"), ("turtle_tf", "turtle_tf_demo_cpp.launch"),
    ("turtle_tf2", "turtle_tf2_demo.launch"), ("turtle_tf2", "turtle_tf2_demo_cpp.launch"),
])  # fmt: skip
def test_a_second_turtle_follows_the_first(ros: RosSystem, package: str, launch: str) -> None:
    ros.serve_master()
    terminal = ros.pipros.open_terminal()
    terminal.type(f"roslaunch {package} {launch}")
    newest: dict[str, Any] = {}
    with Node("observer", environment=Environment(master_uri=ros.master_uri)) as node:
        for turtle in ("turtle1", "turtle2"):
            node.subscribe(
                f"/{turtle}/pose", Pose, lambda pose, key: newest.update({key: pose}), callback_args=turtle
            )

        def distance() -> float:
            one, two = newest.get("turtle1"), newest.get("turtle2")
            return math.hypot(one.x - two.x, one.y - two.y) if one and two else math.inf

        wait_until(lambda: distance() < 0.5, 60, lambda: f"{distance()}\n{terminal.output}")
        # The keys reach teleop through roslaunch. Each one moves the turtle for up to a second, so that a
        # single one might be too few for a busy turtlesim.
        wait_until(
            lambda: terminal.press_in_program("\x1b[A") or newest["turtle1"].x > 6,
            60,
            lambda: str(newest["turtle1"]),
        )
        wait_until(lambda: newest["turtle2"].x > 6, 60, lambda: str(newest["turtle2"]))
    terminal.press_ctrl_c()
    terminal.wait_for_prompt()


@pytest.mark.parametrize("package", ["turtle_tf", "turtle_tf2"])
def test_positions_of_a_turtle_are_printed_in_the_frame_of_another(ros: RosSystem, package: str) -> None:
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", package, f"{package}_sensor.launch")
    found = launched.wait_for(
        r"[Pp]oint of turtle 3 in frame of turtle 1 Position\(x:(\S+) y:(\S+) z:0\.000000\)", 60
    )
    x, y = map(float, found.groups())
    assert math.hypot(x + 1.544445, y + 2.544445) < 2.5  # on its circle, seen from the centre of the picture


def test_the_debugging_demo_shows_both_mistakes(ros: RosSystem) -> None:
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", "turtle_tf", "start_debug_demo.launch")
    launched.wait_for('"turtle3" passed to lookupTransform argument target_frame does not exist', 60)


def test_carrots_are_sent_by_both_libraries(ros: RosSystem) -> None:
    ros.serve_master()
    for package, program in (
        ("turtle_tf", "fixed_tf_broadcaster.py"),
        ("turtle_tf2", "dynamic_tf2_broadcaster.py"),
    ):
        node = ros.pipros.start("rosrun", package, program)
        echo = ros.pipros.start("rostopic", "echo", "/tf/transforms[0]/child_frame_id")
        echo.wait_for("carrot1")
        node.press_ctrl_c()
        node.wait()


def test_a_static_turtle_is_sent_with_its_angles(ros: RosSystem) -> None:
    ros.serve_master()
    arguments = ["mystaticturtle", "0", "0", "1", "0", "0", "1.5707963"]
    ros.pipros.start("rosrun", "turtle_tf2", "static_turtle_tf2_broadcaster", *arguments).wait_for(
        "Spinning until killed publishing mystaticturtle to world"
    )
    echo = ros.pipros.start("rostopic", "echo", "-n1", "/tf_static/transforms[0]/transform/rotation")
    echo.wait_for(r"z: 0\.70710")
    wrong = ros.pipros.run("rosrun", "turtle_tf2", "static_turtle_tf2_broadcaster", "world")
    assert wrong.returncode == 255
    assert "Invalid number of parameters" in wrong.output


def test_a_joystick_steers_a_turtle(ros: RosSystem) -> None:
    start_turtlesim(ros)
    ros.pipros.start("rosrun", "turtle_teleop", "turtle_teleop_joy")
    ros.wait_for_publisher("/turtle1/cmd_vel")
    echo = ros.pipros.start("rostopic", "echo", "/turtle1/cmd_vel/linear/x")
    ros.pipros.start("rostopic", "pub", "-r", "5", "/joy", "sensor_msgs/Joy", "{axes: [0.0, 0.5, 0.25]}")
    echo.wait_for(r"0\.5")


@pytest.mark.parametrize("package", ["turtlesim", "rospy_tutorials", "turtle_tf"])
def test_a_package_of_the_workspace_comes_first(ros: RosSystem, package: str) -> None:
    folder = ros.home / "src" / package
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{package}</name></package>")
    found = ros.pipros.run("rospack", "find", package, ROS_PACKAGE_PATH=str(folder.parent))
    assert found.stdout == [str(folder)]


def test_the_example_of_diagnostics_reports_a_rate(ros: RosSystem) -> None:
    ros.serve_master()
    node = ros.pipros.start("rosrun", "diagnostic_updater", "example")
    echo = ros.pipros.start("rostopic", "echo", "/diagnostics/status")
    echo.wait_for('name: "diagnostic_updater_example: topic1 topic status"')
    echo.wait_for("Desired frequency met")
    node.press_ctrl_c()
    assert node.wait() == 0


def test_the_former_name_of_rqt_reconfigure_opens_its_page(ros: RosSystem) -> None:
    ros.serve_master()
    page = Page.of(ros.pipros.start("rosrun", "dynamic_reconfigure", "reconfigure_gui", "--no-browser"))
    assert page.place == "reconfigure"


@pytest.mark.parametrize(("launch", "line"), [
    ("headers", r"I heard \[hello world \d+\.\d+\], number \d+, sent at \d+\.\d{3}"),
    ("listener_with_user_data", r"The second callback heard \[hello world"),
    ("listener_subscribe_notify", r"I heard Welcome!"),
    ("connection_header", r"from \[/talker_connection_header\] with \[oreo, /talker_connection_header\]"),
    ("on_shutdown", "the motor stops"), ("advanced_publish", "I heard as its only field"),
])  # fmt: skip
def test_the_later_tutorials_of_rospy_run(ros: RosSystem, launch: str, line: str) -> None:
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", "rospy_tutorials", f"{launch}.launch")
    launched.wait_for(line)
    launched.press_ctrl_c()
    assert launched.wait() == 0


@pytest.mark.parametrize("model", ["01-myfirst.urdf", "06-flexible.urdf", "08-macroed.urdf.xacro"])
def test_robots_of_the_urdf_tutorial_are_shown(ros: RosSystem, model: str) -> None:
    ros.serve_master()
    folder = ros.pipros.run("rospack", "find", "urdf_tutorial").stdout[0]
    launched = ros.pipros.start(
        "roslaunch", "urdf_tutorial", "display.launch", f"model:={folder}/urdf/{model}", "gui:=false"
    )
    launched.wait_for(r"http://localhost:\d+/#token=")  # the page of rviz
    ros.wait_for_publisher("/joint_states")
    if not model.startswith("01"):
        state = ros.pipros.run("rostopic", "echo", "-n", "1", "/joint_states/name")
        assert "right_front_wheel_joint" in state.output
    launched.press_ctrl_c()
    assert launched.wait() == 0
