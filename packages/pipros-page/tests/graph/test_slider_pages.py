"""joint_state_publisher_gui and rqt_robot_steering: sliders on a page, and what the nodes publish."""

from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.nodes import Inbox
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Twist: Any = load_message_class("geometry_msgs/Twist")
JointState: Any = load_message_class("sensor_msgs/JointState")

ARM = """<robot name="arm"><link name="base"/><link name="upper"/><link name="lower"/><link name="copy"/>
<joint name="shoulder" type="revolute">
  <parent link="base"/><child link="upper"/><limit lower="-1" upper="2"/>
</joint>
<joint name="lift" type="prismatic">
  <parent link="upper"/><child link="lower"/><limit lower="0.1" upper="0.3"/>
</joint>
<joint name="copied" type="revolute">
  <parent link="lower"/><child link="copy"/><limit lower="-9" upper="9"/>
  <mimic joint="shoulder" multiplier="2"/>
</joint></robot>
"""


@pytest.fixture
def observed(ros: RosSystem) -> Any:
    """The inboxes of `/joint_states` and `/cmd_vel`."""
    ros.serve_master()
    inboxes = Inbox(), Inbox()
    with Node("observer", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe("/joint_states", JointState, inboxes[0])
        node.subscribe("/cmd_vel", Twist, inboxes[1])
        yield inboxes


def positions(inbox: Inbox) -> Any:
    return pytest.approx(inbox.messages[-1].position) if inbox.messages else None


def test_sliders_set_the_positions_of_joints(ros: RosSystem, observed: tuple[Inbox, Inbox]) -> None:
    states = observed[0]
    (ros.home / "arm.urdf").write_text(ARM)
    assert (
        ros.pipros.run("rosparam", "set", "/robot_description", "-t", ros.home / "arm.urdf").returncode == 0
    )
    gui = ros.pipros.start("rosrun", "joint_state_publisher_gui", "joint_state_publisher_gui")
    with Page.of(gui).connect() as browser:
        sliders = browser.watch("sliders")
        first = next(sliders)
        assert first["sliders"] == [
            ["shoulder", -1.0, 2.0, 0, ""],
            ["lift", 0.1, 0.3, pytest.approx(0.2), ""],
        ]
        assert first["buttons"] == ["Randomize", "Center"]
        assert browser.act("move", slider="shoulder", value=0.5) is None
        wait_until(lambda: positions(states) == [0.5, 0.2, 1.0], 30, lambda: str(positions(states)))
        assert states.messages[-1].name == ["shoulder", "lift", "copied"]
        assert browser.act("move", slider="lift", value=7) is None  # ends at its limit
        wait_until(lambda: positions(states) == [0.5, 0.3, 1.0], 30, lambda: str(positions(states)))
        assert browser.act("press", button="Center") is None
        wait_until(lambda: positions(states) == [0, 0.2, 0], 30, lambda: str(positions(states)))
        assert browser.act("press", button="Randomize") is None
        wait_until(lambda: positions(states) != [0, 0.2, 0], 30, lambda: str(positions(states)))
        for wrong in ({"slider": "copied", "value": 1}, {"slider": "lift", "value": "1"}, {"slider": "lift"}):
            assert "error" in browser.act("move", **wrong)
        assert "error" in browser.act("press", button="Explode")
    gui.press_ctrl_c()
    assert gui.wait() == 0


def test_a_gui_without_a_robot_says_so(ros: RosSystem) -> None:
    ros.serve_master()
    gui = ros.pipros.run("rosrun", "joint_state_publisher_gui", "joint_state_publisher_gui")
    assert gui.returncode == 1
    assert "The robot_description parameter is required and not set." in gui.output


def speeds(inbox: Inbox) -> tuple[float, float] | None:
    twist = inbox.messages[-1] if inbox.messages else None
    return twist and (twist.linear.x, twist.angular.z)


@pytest.mark.parametrize(
    "command", [("rosrun", "rqt_robot_steering", "rqt_robot_steering"), ("rqt", "-s", "rqt_robot_steering")]
)
def test_a_robot_is_steered_until_the_browser_leaves(ros, observed, command: tuple[str, ...]) -> None:
    commands = observed[1]
    steering = ros.pipros.start(*command)
    page = Page.of(steering)
    ros.wait_for_publisher("/cmd_vel")
    with page.connect() as browser:
        sliders = browser.watch("sliders")
        assert next(sliders)["sliders"] == [["linear", -3, 3, 0, "m/s"], ["angular", -3, 3, 0, "rad/s"]]
        browser.act("move", slider="linear", value=0.5)
        browser.act("move", slider="angular", value=-1)
        wait_until(lambda: speeds(commands) == (0.5, -1.0), 30, lambda: str(speeds(commands)))
        browser.act("press", button="Stop")
        wait_until(lambda: speeds(commands) == (0.0, 0.0), 30, lambda: str(speeds(commands)))
        browser.act("move", slider="linear", value=2)
        wait_until(lambda: speeds(commands) == (2.0, 0.0), 30, lambda: str(speeds(commands)))
    wait_until(lambda: speeds(commands) == (0.0, 0.0), 30, lambda: str(speeds(commands)))
    steering.press_ctrl_c()
    assert steering.wait() == 0


def test_a_suspended_browser_stops_the_robot_and_does_not_restart_it(ros: RosSystem, observed) -> None:
    commands = observed[1]
    steering = ros.pipros.start("rosrun", "rqt_robot_steering", "rqt_robot_steering")
    ros.wait_for_publisher("/cmd_vel")
    with Page.of(steering).connect() as browser:
        assert next(browser.watch("sliders"))["holds"]
        browser.act("move", slider="linear", value=0.5)

        def hold() -> int:
            browser.act("hold", slider="linear", value=0.5)
            return len(commands.messages)

        wait_until(lambda: hold() >= 15)  # longer than a silent browser drives
        assert speeds(commands) == (0.5, 0.0)
        wait_until(lambda: speeds(commands) == (0.0, 0.0), 10)
        hold()
        browser.act("move", slider="angular", value=-1)
        wait_until(lambda: speeds(commands) == (0.0, -1.0))


@pytest.mark.parametrize("rate", [0, 20])
def test_a_suspended_browser_publishes_no_velocity(ros: RosSystem, observed, rate: float) -> None:
    commands = observed[1]
    message = {"message": "linear: {x: 0.5}", "rate": rate}
    with Page(ros, "--control").connect() as browser:
        view = browser.watch("publishing", name="/cmd_vel", type="geometry_msgs/Twist", **message)
        wait_until(lambda: next(view)["count"] > min(rate, 1))
        wait_until(lambda: speeds(commands) == (0.5, 0.0))
        with browser.socket.protocol_mutex:  # it answers no ping
            wait_until(lambda: speeds(commands) == (0.0, 0.0), 10)
        error = next(each["error"] for each in view if "error" in each)
        assert error == "the browser was silent for 1 s: /cmd_vel was stopped"


def test_the_robot_stops_with_the_node(ros: RosSystem, observed: tuple[Inbox, Inbox]) -> None:
    commands = observed[1]
    steering = ros.pipros.start("rosrun", "rqt_robot_steering", "rqt_robot_steering", "_default_vx_max:=1")
    ros.wait_for_publisher("/cmd_vel")
    with Page.of(steering).connect() as browser:
        assert next(browser.watch("sliders"))["sliders"][0] == ["linear", -3, 1, 0, "m/s"]
        browser.act("move", slider="linear", value=5)
        wait_until(lambda: speeds(commands) == (1.0, 0.0), 30, lambda: str(speeds(commands)))
        steering.press_ctrl_c()
        assert steering.wait() == 0
    wait_until(lambda: speeds(commands) == (0.0, 0.0), 30, lambda: str(speeds(commands)))
