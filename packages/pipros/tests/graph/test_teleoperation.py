"""Keys, joysticks and interactive markers steer robots. Not tested with a real device."""

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback

from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.teleoperation.joystick import AXIS, BUTTON, EVENT, INIT
from pipros_libraries.teleoperation.twist_marker import NAMESPACE, Scales
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# Keys and joysticks steer robots. The joystick is a FIFO with bytes as sent by the kernel. Not tested with
# a real device.


@pytest.fixture
def commands(ros: RosSystem) -> Iterator[Inbox]:
    """The messages of `/cmd_vel`."""
    ros.serve_master()
    inbox = Inbox()
    with ros.node("robot") as node:
        inbox.subscriber = node.subscribe("/cmd_vel", Twist, inbox)
        yield inbox


def newest(inbox: Inbox) -> tuple[float, float] | None:
    twist = inbox.messages[-1] if inbox.messages else None
    return twist and (twist.linear.x, twist.angular.z)


class Joystick:
    """A FIFO in place of a device."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "js0"
        os.mkfifo(self.path)
        self._writer = os.open(self.path, os.O_RDWR)

    def send(self, value: int, kind: int, number: int) -> None:
        os.write(self._writer, EVENT.pack(0, value, kind, number))

    def unplug(self) -> None:
        os.close(self._writer)


def test_keys_in_a_terminal_steer_and_ctrl_c_stops_the_robot(ros: RosSystem, commands: Inbox) -> None:
    terminal = ros.pipros.open_terminal()
    terminal.type("rosrun teleop_twist_keyboard teleop_twist_keyboard.py _key_timeout:=0")
    wait_until(lambda: "currently:\tspeed 0.5\tturn 1.0" in terminal.text, 30, lambda: terminal.text)
    # `k` stops the robot. It is pressed until the two nodes are connected.
    wait_until(lambda: terminal.press_in_program("k") or newest(commands) == (0.0, 0.0), 30, "a connection")
    for key, speeds in (("i", (0.5, 0.0)), ("q", (0.55, 0.0)), ("u", (0.55, 1.1)), ("k", (0.0, 0.0))):
        terminal.press_in_program(key)
        wait_until(
            lambda: newest(commands) == pytest.approx(speeds),  # noqa: B023
            30,
            lambda: str(newest(commands)),
        )
    terminal.press_in_program("i")
    wait_until(lambda: newest(commands) == pytest.approx((0.55, 0.0)), 30, lambda: str(newest(commands)))
    terminal.press_ctrl_c()
    terminal.wait_for_prompt()
    wait_until(lambda: newest(commands) == (0.0, 0.0), 30, lambda: str(newest(commands)))


def test_the_robot_stops_some_time_after_the_last_key(ros: RosSystem, commands: Inbox) -> None:
    terminal = ros.pipros.open_terminal()
    terminal.type("rosrun teleop_twist_keyboard teleop_twist_keyboard.py _repeat_rate:=20 _key_timeout:=0.3")
    wait_until(lambda: "currently:" in terminal.text, 30, lambda: terminal.text)
    ros.wait_for_publisher("/cmd_vel")
    wait_until(lambda: commands.messages, 30, "commands at a rate")
    terminal.press_in_program("i")
    wait_until(lambda: any(twist.linear.x for twist in commands.messages), 30, "a command to move")
    wait_until(lambda: newest(commands) == (0.0, 0.0), 30, lambda: str(newest(commands)))
    terminal.press_ctrl_c()
    terminal.wait_for_prompt()


def test_a_joystick_steers_while_its_button_is_held(ros: RosSystem, commands: Inbox, tmp_path: Path) -> None:
    stick = Joystick(tmp_path)
    launched = ros.pipros.start(
        "roslaunch", "teleop_twist_joy", "teleop.launch", f"joy_dev:={stick.path}", "joy_config:=xbox"
    )
    ros.wait_for_publisher("/cmd_vel")
    ros.wait_for_subscriber("/joy")
    for number in range(6):
        stick.send(0, BUTTON | INIT, number)
        stick.send(0, AXIS | INIT, number)
    stick.send(-32767, AXIS, 1)
    stick.send(1, BUTTON, 2)
    wait_until(lambda: newest(commands) == pytest.approx((0.7, 0.0)), 60, lambda: str(newest(commands)))
    stick.send(1, BUTTON, 5)
    wait_until(lambda: newest(commands) == pytest.approx((1.5, 0.0)), 30, lambda: str(newest(commands)))
    stick.send(0, BUTTON, 5)
    stick.send(0, BUTTON, 2)
    wait_until(lambda: newest(commands) == (0.0, 0.0), 30, lambda: str(newest(commands)))
    launched.press_ctrl_c(code=0)
    stick.unplug()


@pytest.mark.parametrize("repeats", [1, 5])
def test_a_joystick_that_ends_or_stops_repeating_its_state_stops_the_robot(ros, commands, repeats) -> None:
    ros.pipros.start("rosrun", "teleop_twist_joy", "teleop_node")
    joy: Any = load_message_class("sensor_msgs/Joy")
    ros.wait_for_subscriber("/joy")
    with ros.node("stick") as node:
        topic = node.advertise("/joy", joy, queue_size=10)
        wait_until_connected(topic)
        wait_until(lambda: topic.publish(joy(axes=[0, 0.1], buttons=[1])) or commands.messages)
        for speed in (0.3, *[0.5] * repeats):
            count = len(commands.messages)
            topic.publish(joy(axes=[0, speed], buttons=[1]))
            wait_until(lambda: len(commands.messages) > count)  # noqa: B023
        if repeats > 1:
            wait_until(lambda: newest(commands) == (0.0, 0.0))
        else:
            assert newest(commands) == (0.25, 0.0)
    wait_until(lambda: newest(commands) == (0.0, 0.0))


def test_a_missing_or_lost_joystick_is_opened_again(ros: RosSystem, commands: Inbox, tmp_path: Path) -> None:
    path = tmp_path / "js0"
    node = ros.pipros.start("rosrun", "joy", "joy_node", f"_dev:={path}", "_autorepeat_rate:=10")
    node.wait_for(r"Couldn't open joystick \S+js0 \(No such file or directory\). Will retry every second.")
    stick = Joystick(tmp_path)
    node.wait_for(r"Opened joystick: \S+js0 \(Unknown\). deadzone_: 0.050000.")
    echo = ros.pipros.start("rostopic", "echo", "/joy/buttons")
    ros.wait_for_subscriber("/joy")
    stick.send(1, BUTTON, 1)
    echo.wait_for(r"\[0, 1\]")
    stick.unplug()
    echo.wait_for(r"\[0, 0\]")
    node.wait_for("Connection to joystick device lost unexpectedly. Will reopen.")
    node.press_ctrl_c(code=0)


MUX = """<launch>
  <node pkg="twist_mux" type="twist_mux" name="twist_mux" ns="robot">
    <remap from="cmd_vel_out" to="/cmd_vel"/>
    <rosparam>
      topics:
      - {name: navigation, topic: nav_vel, timeout: 0, priority: 10}
      - {name: joystick, topic: /joy_vel, timeout: 60.0, priority: 100}
      - {name: broken, topic: broken_vel, priority: 200}
      locks:
      - {name: pause, topic: pause, timeout: 0.0, priority: 150}
    </rosparam>
  </node>
</launch>
"""


def test_twist_mux_passes_on_the_velocities_of_the_source_that_may_steer(ros, commands, tmp_path) -> None:
    (tmp_path / "mux.launch").write_text(MUX)
    launch = ros.pipros.start("roslaunch", tmp_path / "mux.launch")
    launch.wait_for(r"~topics\[2\]: timeout must be a number of seconds, got None")
    flag: Any = load_message_class("std_msgs/Bool")
    array: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
    diagnostics = Inbox()
    with ros.node("sources") as node:
        node.subscribe("/diagnostics", array, diagnostics)
        navigation, joystick = (
            node.advertise(name, Twist, queue_size=1) for name in ("/robot/nav_vel", "/joy_vel")
        )
        pause = node.advertise("/robot/pause", flag, queue_size=1)
        for each in (navigation, joystick, pause, commands.subscriber):
            wait_until_connected(each)

        def send(topic: Any, speed: float) -> None:
            twist = Twist()
            twist.linear.x = speed
            topic.publish(twist)

        def state() -> dict[str, str]:
            status = diagnostics.messages[-1].status[0] if diagnostics.messages else None
            return {each.key: each.value for each in status.values} if status else {}

        send(navigation, 0.1)
        wait_until(lambda: newest(commands) == (0.1, 0.0))
        send(joystick, 0.2)
        wait_until(lambda: newest(commands) == (0.2, 0.0))
        wait_until(lambda: state().get("current priority") == "0")
        assert diagnostics.messages[-1].status[0].name == "robot/twist_mux: Twist mux status"

        pause.publish(flag(True))
        wait_until(lambda: state().get("current priority") == "150")
        assert state()["velocity joystick"].startswith(" masked (listening to /joy_vel @ 60.000000s")
        pause.publish(flag(False))
        wait_until(lambda: state().get("current priority") == "0")
        send(joystick, 0.3)
        wait_until(lambda: newest(commands) == (0.3, 0.0))
    found = [each.linear.x for each in commands.messages]
    assert [each for each in found if each] == [0.1, 0.2, 0.3]
    assert found[2] == found[found.index(0.3) - 1] == 0.0, "zeros from the lock to its end"
    launch.press_ctrl_c()
    launch.wait()


# The node marker_server of interactive_marker_twist_server.


def test_velocities_are_scaled_and_limited_by_axis() -> None:
    scales = Scales({"x": (2.0, -0.5, 1.0), "z": (1.0, -1.0, 1.0)}, angular=0.5, greatest_turn=0.3)
    assert scales.velocity((0.2, 9.0, -0.4), 0.1) == ((0.4, 0.0, -0.4), 0.05)
    assert scales.velocity((5.0, 0.0, 5.0), 2.0) == ((1.0, 0.0, 1.0), 0.3)
    assert scales.velocity((-5.0, 0.0, -5.0), -2.0) == ((-0.5, 0.0, -1.0), -0.3)


class Viewer:
    """A viewer like rviz, on one marker server."""

    def __init__(self, node: Node) -> None:
        self.commands, self.updates, self.full = Inbox(), Inbox(), Inbox()
        for topic, kind, inbox in (
            ("/twist_marker_server/cmd_vel", "geometry_msgs/Twist", self.commands),
            (f"/{NAMESPACE}/update", "visualization_msgs/InteractiveMarkerUpdate", self.updates),
            (f"/{NAMESPACE}/update_full", "visualization_msgs/InteractiveMarkerInit", self.full),
        ):
            node.subscribe(topic, load_message_class(kind), inbox)
        self._feedback = node.advertise(f"/{NAMESPACE}/feedback", Feedback, queue_size=5)

    def connect(self) -> None:
        self.full.wait()
        wait_until_connected(self._feedback)

    def drag(self, event: int = Feedback.POSE_UPDATE, x: float = 0.0, yaw: float = 0.0, **more: Any) -> Any:
        """Send feedback, and return the command that it causes."""
        count = len(self.commands.messages)
        feedback = Feedback(marker_name="husky_twist_marker", client_id="rviz", event_type=event)
        feedback.pose.position.x = x
        feedback.pose.orientation.z, feedback.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        for name, value in more.items():
            setattr(feedback.pose.position, name, value)
        self._feedback.publish(feedback)
        return self.commands.wait(count + 1)[count]


@pytest.fixture
def server(ros: RosSystem) -> Iterator[tuple[Viewer, Process]]:
    ros.serve_master()
    with ros.node("viewer") as node:
        scale = "{x: 1.0, y: 0.5}"
        high, low = "{x: 0.8, y: 0.2}", "{x: -0.4}"
        process = ros.pipros.start(
            "rosrun", "interactive_marker_twist_server", "marker_server", "__name:=twist_marker_server",
            "_robot_name:=husky", "_link_name:=/base_footprint", f"_linear_scale:={scale}",
            f"_max_positive_linear_velocity:={high}", f"_max_negative_linear_velocity:={low}",
        )  # fmt: skip
        viewer = Viewer(node)
        viewer.connect()
        yield viewer, process
        process.press_ctrl_c(code=0)


def test_a_marker_drives_the_robot_and_returns_to_it(server: tuple[Viewer, Process]) -> None:
    viewer, process = server
    (marker,) = viewer.full.messages[0].markers
    assert (marker.name, marker.header.frame_id) == ("husky_twist_marker", "base_footprint")
    assert [each.interaction_mode for each in marker.controls] == [3, 3, 5]  # two axes, one turn
    process.wait_for("must contain y, as linear_scale does: 0 is used")
    assert viewer.drag(x=0.3, yaw=0.1).linear.x == pytest.approx(0.3)
    assert viewer.drag(Feedback.KEEP_ALIVE, x=-3.0, yaw=-0.1).angular.z == pytest.approx(-0.22)
    assert (viewer.drag(x=3.0).linear.x, viewer.drag(y=-1.0).linear.y) == (pytest.approx(0.8), 0.0)

    def is_back() -> bool:
        poses = [pose for update in viewer.updates.messages for pose in update.poses]
        return bool(poses) and poses[-1].pose.position.x == 0.0 and poses[-1].name == marker.name

    wait_until(is_back, 30)


def test_a_released_or_invalid_marker_stops_the_robot(server: tuple[Viewer, Process]) -> None:
    viewer, _ = server
    still = load_message_class("geometry_msgs/Twist")()
    assert viewer.drag(x=0.3) != still
    assert viewer.drag(Feedback.MOUSE_UP, x=0.3) == still
    assert viewer.drag(x=0.3) != still
    assert viewer.drag(x=math.nan) == still
    assert viewer.drag(x=1e308, z=1e308).linear.x == pytest.approx(0.8)


def test_a_server_says_every_half_second_that_it_is_there(server: tuple[Viewer, Process]) -> None:
    viewer, _ = server
    viewer.updates.messages.clear()
    wait_until(
        lambda: len([each for each in viewer.updates.messages if each.type == each.KEEP_ALIVE]) > 2, 30
    )
