"""The commands for turtlesim in courses, as typed, and its page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.service_link import ServiceFailed
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.page import Page
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Pose: Any = load_message_class("turtlesim/Pose")
Twist: Any = load_message_class("geometry_msgs/Twist")
MIDDLE = 5.544444561004639
LOG_LINE = r"\[ INFO\] \[\d+\.\d{9}\]: "


def start_turtlesim(ros: RosSystem, *arguments: str) -> Process:
    """Start a master and turtlesim, until its first turtle is there."""
    ros.pipros.start_master()
    turtlesim = ros.pipros.start("rosrun", "turtlesim", "turtlesim_node", *arguments)
    ros.wait_for_subscriber("/turtle1/cmd_vel")
    master = MasterClient(ros.master_uri, "/a_test")
    wait_until(lambda: "/kill" in dict(master.get_system_state()[2]), what="the last service of turtlesim")
    master.close()
    return turtlesim


def output_of(ros: RosSystem, *words: str) -> list[str]:
    """Type a command that succeeds, and return what it prints."""
    ended = ros.pipros.run(*words)
    assert ended.returncode == 0, ended.output
    return ended.stdout


def pose_of(ros: RosSystem, turtle: str = "turtle1") -> dict[str, float]:
    rows = output_of(ros, "rostopic", "echo", "-n1", f"/{turtle}/pose")
    return {key: float(value) for key, _, value in (row.partition(": ") for row in rows if ": " in row)}


def wait_for_pose(ros: RosSystem, condition: Callable[[Any], object], turtle: str = "turtle1") -> Any:
    """Wait for a pose that meets a condition."""
    newest: list[Any] = [None]
    with Node("test_pose", environment=Environment(master_uri=ros.master_uri)) as node:

        def keep(pose: Any) -> None:
            newest[0] = pose

        node.subscribe(f"/{turtle}/pose", Pose, keep)
        wait_until(lambda: newest[0] is not None and condition(newest[0]), 60, lambda: f"{newest[0]}")
        return newest[0]


def test_topics_and_services_are_those_of_the_wiki(ros: RosSystem) -> None:
    turtlesim = start_turtlesim(ros)
    ros.wait_for_publisher("/rosout_agg")
    turtlesim.wait_for(LOG_LINE + "Starting turtlesim with node name /turtlesim")
    turtlesim.wait_for(
        LOG_LINE + r"Spawning turtle \[turtle1\] at x=\[5\.544445\], y=\[5\.544445\], theta=\[0\.000000\]"
    )
    assert output_of(ros, "rosnode", "list") == ["/rosout", "/turtlesim"]
    assert {"/turtle1/cmd_vel", "/turtle1/color_sensor", "/turtle1/pose"} < set(
        output_of(ros, "rostopic", "list")
    )
    assert output_of(ros, "rostopic", "type", "/turtle1/cmd_vel") == ["geometry_msgs/Twist"]
    assert {"/clear", "/kill", "/reset", "/spawn", "/turtle1/set_pen", "/turtle1/teleport_absolute"} < set(
        output_of(ros, "rosservice", "list")
    )
    assert output_of(ros, "rosservice", "type", "/clear") == ["std_srvs/Empty"]
    assert output_of(ros, "rosversion", "turtlesim") == ["0.10.2"]
    assert pose_of(ros) == {
        "x": MIDDLE, "y": MIDDLE, "theta": 0.0, "linear_velocity": 0.0, "angular_velocity": 0.0,
    }  # fmt: skip
    turtlesim.press_ctrl_c()
    assert turtlesim.wait() == 0


def test_a_command_moves_the_turtle_for_a_second(ros: RosSystem) -> None:
    start_turtlesim(ros)
    pub = ["rostopic", "pub", "-1", "/turtle1/cmd_vel", "geometry_msgs/Twist", "--"]
    output_of(ros, *pub, "[2.0, 0.0, 0.0]", "[0.0, 0.0, 1.8]")
    pose = wait_for_pose(ros, lambda pose: pose.theta > 0 and pose.linear_velocity == 0)
    # It moves for the ticks of a second of wall time, 62 or 63 if the processor is not busy.
    assert 0 < pose.theta <= 70 * 0.0288


def test_services_of_the_wiki_and_their_failures(ros: RosSystem) -> None:
    turtlesim = start_turtlesim(ros)
    assert output_of(ros, "rosservice", "call", "/spawn", "2", "2", "0.2", "") == ['name: "turtle2"']
    again = ros.pipros.run("rosservice", "call", "/spawn", "2", "2", "0.2", "turtle2")
    assert again.returncode == 2  # as genuine rosservice
    assert again.stderr == ["ERROR: service [/spawn] responded with an error: b''"]
    turtlesim.wait_for(r"\[ERROR\] \[\d+\.\d{9}\]: A turtled named \[turtle2\] already exists")
    unknown = ros.pipros.run("rosservice", "call", "/kill", "ghost")
    assert unknown.stderr == ["ERROR: service [/kill] responded with an error: b''"]
    turtlesim.wait_for(r"\[ERROR\] \[\d+\.\d{9}\]: Tried to kill turtle \[ghost\], ")
    output_of(ros, "rosservice", "call", "/kill", "turtle2")
    assert "/turtle2/pose" not in output_of(ros, "rostopic", "list")
    output_of(ros, "rosservice", "call", "/turtle1/set_pen", "255", "0", "0", "5", "0")
    output_of(ros, "rosservice", "call", "/turtle1/teleport_absolute", "20", "3", "0")
    turtlesim.wait_for(r"\[ WARN\] .*Clamping from \[x=20\.000000, y=8\.088889\]")
    output_of(ros, "rosservice", "call", "/turtle1/teleport_relative", "--", "-2", "0")
    output_of(ros, "rostopic", "echo", "-n1", "/turtle1/pose")
    assert output_of(ros, "rostopic", "echo", "-n1", "/turtle1/color_sensor")[:2] == ["r: 255", "g: 0"]
    output_of(ros, "rosparam", "set", "/turtlesim/background_r", "150")
    assert output_of(ros, "rosparam", "get", "/turtlesim/background_g") == ["86"]
    output_of(ros, "rosservice", "call", "/clear")
    assert output_of(ros, "rostopic", "echo", "-n1", "/turtle1/color_sensor")[0] == "r: 150"
    output_of(ros, "rosservice", "call", "/reset")
    turtlesim.wait_for("Resetting turtlesim")
    assert pose_of(ros)["x"] == MIDDLE


def test_values_that_turtlesim_cannot_hold_are_refused(ros: RosSystem) -> None:
    turtlesim = start_turtlesim(ros)
    teleport: Any = load_service_class("turtlesim/TeleportAbsolute")
    spawn: Any = load_service_class("turtlesim/Spawn")
    with Node("a_test", environment=Environment(master_uri=ros.master_uri)) as node:
        for client, request in (
            (node.client("/turtle1/teleport_absolute", teleport), teleport._request_class(x=float("nan"))),
            (node.client("/spawn", spawn), spawn._request_class(y=float("inf"))),
            (node.client("/spawn", spawn), spawn._request_class(name="no name")),
            (node.client("/spawn", spawn), spawn._request_class(name="turtle2/")),
            (node.client("/spawn", spawn), spawn._request_class(name="~mine")),
            (node.client("/spawn", spawn), spawn._request_class(name="/turtle1")),
        ):
            with pytest.raises(ServiceFailed):
                client.call(request, 30)
        publisher = node.advertise("/turtle1/cmd_vel", Twist, latch=True)
        twist = Twist()
        twist.linear.x = float("nan")
        publisher.publish(twist)
        turtlesim.wait_for("ignores commands that are not finite")
    assert pose_of(ros)["x"] == MIDDLE


def test_logger_levels_change_while_it_runs(ros: RosSystem) -> None:
    turtlesim = start_turtlesim(ros)
    set_level = ("rosservice", "call", "/turtlesim/set_logger_level", "ros.turtlesim")
    output_of(ros, *set_level, "Debug")
    turtlesim.wait_for(
        r"\[DEBUG\] \[\d+\.\d{9}\]: \[/turtle1\]: pos_x: 5\.544445 pos_y: 5\.544445 theta: 0\.0"
    )
    output_of(ros, *set_level, "Warn")


def test_the_arrow_keys_of_teleop_move_the_turtle(ros: RosSystem) -> None:
    start_turtlesim(ros)
    ros.pipros.run("rosparam", "set", "/scale_linear", "3.0")
    terminal = ros.pipros.open_terminal()
    terminal.type("rosrun turtlesim turtle_teleop_key")
    terminal.wait_for("Reading from keyboard\n-{27}\nUse arrow keys to move the turtle. 'q' to quit.")
    ros.wait_for_publisher("/turtle1/cmd_vel")
    inbox = Inbox()
    with Node("a_test", environment=Environment(master_uri=ros.master_uri)) as node:
        wait_until_connected(node.subscribe("/turtle1/cmd_vel", Twist, inbox))
        terminal.answer("\x1b[A\x1b[B")
        terminal.answer("\x1b[C\x1b[D")
        commands = [(twist.linear.x, twist.angular.z) for twist in inbox.wait(4)]
    assert commands == [(3.0, 0.0), (-3.0, 0.0), (0.0, -2.0), (0.0, 2.0)]
    terminal.press_in_program("xq")
    assert terminal.wait_for_prompt() == 0
    code, echoed = terminal.run("echo back")
    assert (code, echoed.strip()) == (0, "back")


def test_teleop_ends_with_its_input(ros: RosSystem) -> None:
    start_turtlesim(ros)
    code, _ = ros.pipros.open_terminal().run("rosrun turtlesim turtle_teleop_key < /dev/null")
    assert code == 0


def test_mimic_makes_a_second_turtlesim_follow_the_first(ros: RosSystem) -> None:
    launch = ros.home / "turtlemimic.launch"
    launch.write_text(
        """<launch>
  <include file="$(find turtlesim)/launch/multisim.launch"/>
  <node pkg="turtlesim" name="mimic" type="mimic">
    <remap from="input" to="turtlesim1/turtle1"/>
    <remap from="output" to="turtlesim2/turtle1"/>
  </node>
</launch>"""
    )
    ros.pipros.start_master()
    launched = ros.pipros.start("roslaunch", launch)
    ros.wait_for_publisher("/turtlesim2/turtle1/cmd_vel")
    ros.wait_for_subscriber("/turtlesim1/turtle1/cmd_vel")
    pub = ["rostopic", "pub", "-r", "5", "/turtlesim1/turtle1/cmd_vel", "geometry_msgs/Twist", "--"]
    ros.pipros.start(*pub, "[2.0, 0.0, 0.0]", "[0.0, 0.0, -1.8]")
    wait_for_pose(ros, lambda pose: pose.theta < -0.5, "turtlesim2/turtle1")
    page = Page(ros)
    with page.connect() as browser:
        arrows = {
            ("/turtlesim1/sim", "/turtlesim1/turtle1/pose"),
            ("/turtlesim1/turtle1/pose", "/mimic"),
            ("/mimic", "/turtlesim2/turtle1/cmd_vel"),
            ("/turtlesim2/turtle1/cmd_vel", "/turtlesim2/sim"),
        }
        shown = (value.get("scene", {}).get("arrows", ()) for value in browser.watch("graph"))
        assert any(
            arrows <= {(arrow["start"]["name"], arrow["end"]["name"]) for arrow in scene} for scene in shown
        )
    launched.press_ctrl_c()
    assert launched.wait() == 0


def test_draw_square_turns_at_the_first_corner(ros: RosSystem) -> None:
    start_turtlesim(ros)
    ros.pipros.start("rosrun", "turtlesim", "draw_square").wait_for(
        LOG_LINE + r"New goal \[7\.544445 5\.544445, 0\.000000\]"
    )
    wait_for_pose(ros, lambda pose: pose.angular_velocity > 0.3)


def test_the_page_shows_the_world_and_steers_its_own_turtles(ros: RosSystem) -> None:
    turtlesim = start_turtlesim(ros)
    page = Page.of(turtlesim)
    index = page.get("/")
    assert index.status == 200
    assert b"TurtleSim" in index.read()
    assert page.get("/live.js").status == 200
    assert page.get("/tabs/graph.js").status == 404  # of the page of the rqt commands
    with page.connect() as browser:
        views = browser.watch("world")
        first = next(views)
        assert [turtle[0] for turtle in first["turtles"]] == ["turtle1"]
        assert first["picture"].startswith("iVBORw0KGgo")  # the magic bytes of PNG
        assert browser.act("steer", turtle="turtle1", linear=2.0, angular=0.0) is None
        assert next(value for value in views if value.get("lines"))["lines"][0][4:] == [3, 179, 184, 255]
        assert "error" in browser.act("steer", turtle="turtle9", linear=2.0, angular=0.0)
        assert "error" in browser.act("steer", turtle="turtle1", linear=None, angular=0.0)
        assert "error" in browser.act("steer", turtle="turtle1", linear=float("inf"), angular=0.0)
        assert ros.publishers("/turtle1/cmd_vel") == []
        assert browser.act("close") is None
    assert turtlesim.wait() == 0


def test_strangers_cannot_use_the_page(ros: RosSystem) -> None:
    page = Page.of(start_turtlesim(ros))
    assert page.get("/", Host="evil.example").status == 403
    with pytest.raises(InvalidStatus), page.connect(origin="http://evil.example"):
        pass
    with page.connect(first='{"token": "wrong"}') as browser, pytest.raises(ConnectionClosed):
        browser.socket.recv(timeout=30)


def test_headless_there_is_no_page(ros: RosSystem) -> None:
    turtlesim = start_turtlesim(ros, "_headless:=true")
    pose_of(ros)
    assert "http" not in turtlesim.output


def test_no_master_is_reported_as_in_roscpp_and_ctrl_c_ends_the_wait(ros: RosSystem) -> None:
    turtlesim = ros.pipros.start("rosrun", "turtlesim", "turtlesim_node")
    place = ros.master_uri.removeprefix("http://")
    turtlesim.wait_for(rf"\[ERROR\] .*\[registerPublisher\] Failed to contact master at \[{place}\]")
    turtlesim.press_ctrl_c()
    assert turtlesim.wait() == 0
