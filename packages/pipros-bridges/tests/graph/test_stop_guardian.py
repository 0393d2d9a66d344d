"""The guardian stops a robot that holds its last command, whatever happens to clients and servers."""

import itertools
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_server.act_gate import ActGate
from pipros_server.guardian_process import REPETITIONS
from pipros_server.policy.model import ActRefused
from pipros_server.policy.policy_file import parse_policy
from tests.support.foxglove import connected
from tests.support.page import Page
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.rosbridge import RosbridgeClient
from tests.support.waiting import wait_until

TWIST: Any = load_message_class("geometry_msgs/Twist")
VECTOR: Any = load_message_class("geometry_msgs/Vector3")
GOAL_ID: Any = load_message_class("actionlib_msgs/GoalID")
DRIVE = "linear: {x: 0.2}"
LONG_S, SHORT_S = 3000, 0.5
"""A limit that cannot pass during a test, and one that does."""
POLICY = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {{linear.x: {{range: [-0.3, 0.3], unit: m/s}}}}
    {limit}
actions:
  /fibonacci:
    type: actionlib_tutorials/FibonacciAction
    fields: any
    per_minute: 1
    {limit}
"""
HALTING = """\
actions:
  /fibonacci:
    type: actionlib_tutorials/FibonacciAction
    fields: any
    time_limit_s: {limit_s}
    stop: {{topic: /cmd_vel, type: geometry_msgs/Twist}}
"""


class Robot:
    """A robot that drives for ever as its last command says.

    Attributes:
        speed: of the last command.
        stops: how many commands were zero.
        cancelled: the ids of cancelled goals.
    """

    def __init__(self, master_uri: str) -> None:
        self.speed = 0.0
        self.stops = 0
        self.cancelled: list[str] = []
        self.node = Node("robot", environment=Environment(master_uri=master_uri))
        self.node.start()
        self.subscriber = self.node.subscribe("/cmd_vel", TWIST, self._drive)
        self.node.subscribe("/fibonacci/cancel", GOAL_ID, lambda message: self.cancelled.append(message.id))

    def _drive(self, message: Any) -> None:
        self.speed = message.linear.x
        self.stops += message.linear.x == 0

    @property
    def is_driving(self) -> bool:
        return self.speed != 0

    @property
    def has_stopped(self) -> bool:
        return self.speed == 0


@pytest.fixture
def robot(ros: RosSystem) -> Iterator[Robot]:
    ros.serve_master()
    found = Robot(ros.master_uri)
    yield found
    found.node.shutdown()


Serve = Callable[[float | None], tuple[Process, str]]


@pytest.fixture
def serve(ros: RosSystem, robot: Robot, tmp_path: Path) -> Serve:
    """Return a function that starts a server whose policy has a time limit, or none."""
    del robot

    def start(limit_s: float | None) -> tuple[Process, str]:
        limit = "" if limit_s is None else f"time_limit_s: {limit_s}"
        (tmp_path / "p.yaml").write_text(POLICY.format(limit=limit))
        server = ros.pipros.start(
            "pipros", "serve", "--port", "0", "--control", "--policy", tmp_path / "p.yaml"
        )
        return server, server.wait_for(r"ws://\S+")[0]

    return start


def drive(client: RosbridgeClient, robot: Robot) -> None:
    """Let the robot drive."""
    client.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist")

    def drives() -> bool:
        client.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.2}})
        return robot.is_driving

    wait_until(drives)


def guardian_of(server: Process) -> psutil.Process:
    """Return the guardian of a server."""
    children = psutil.Process(server.pid).children(recursive=True)
    (found,) = [each for each in children if "pipros_server.guardian_process" in each.cmdline()]
    return found


def test_a_robot_stops_when_its_client_falls_silent(serve: Serve, robot: Robot) -> None:
    with RosbridgeClient(serve(SHORT_S)[1]) as client:
        drive(client, robot)
        wait_until(lambda: robot.has_stopped)
        drive(client, robot)
        wait_until(lambda: robot.has_stopped)


def test_a_robot_stops_when_its_client_is_killed(serve: Serve, robot: Robot) -> None:
    with RosbridgeClient(serve(LONG_S)[1]) as client:
        drive(client, robot)
        client.socket.socket.shutdown(socket.SHUT_RDWR)  # as the kernel does for a process that is killed
        wait_until(lambda: robot.has_stopped)


def test_a_robot_does_not_stop_when_another_client_leaves(serve: Serve, robot: Robot) -> None:
    url = serve(LONG_S)[1]
    with RosbridgeClient(url) as client:
        with RosbridgeClient(url) as other:
            drive(other, robot)
            other.call("/rosapi/topics")  # after the response, all that it has sent is published
            client.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
            wait_until(lambda: robot.speed == 0.1)
        with RosbridgeClient(url) as third:  # the server has noticed that the other one has left
            third.call("/rosapi/topics")
        assert robot.stops == 0
        client.send("unadvertise", topic="/cmd_vel")
        wait_until(lambda: robot.has_stopped)


def test_a_robot_stops_when_its_server_is_killed(serve: Serve, robot: Robot) -> None:
    server, url = serve(LONG_S)
    with RosbridgeClient(url) as client:
        drive(client, robot)
        server.kill()
        wait_until(lambda: robot.stops == REPETITIONS)
        assert robot.has_stopped


def test_without_a_time_limit_a_robot_drives_on_after_its_server_was_killed(
    serve: Serve, robot: Robot
) -> None:
    server, url = serve(None)
    with RosbridgeClient(url) as client:
        drive(client, robot)
        wait_until(lambda: robot.subscriber.connection_count == 1)
        server.kill()
        wait_until(lambda: robot.subscriber.connection_count == 0)
        assert (robot.is_driving, robot.stops) == (True, 0)


def test_a_robot_stops_when_its_server_hangs(serve: Serve, robot: Robot) -> None:
    server, url = serve(SHORT_S)
    with RosbridgeClient(url) as client:
        drive(client, robot)
        server.send_signal(signal.SIGSTOP)
        try:
            wait_until(lambda: robot.has_stopped)
        finally:
            server.send_signal(signal.SIGCONT)


def test_a_robot_stops_when_its_server_ends(serve: Serve, robot: Robot) -> None:
    server, url = serve(LONG_S)
    with RosbridgeClient(url) as client:
        drive(client, robot)
        server.press_ctrl_c()
        wait_until(lambda: robot.has_stopped)


def test_a_robot_stops_when_its_guardian_is_killed_and_can_drive_on(serve: Serve, robot: Robot) -> None:
    server, url = serve(LONG_S)
    with RosbridgeClient(url) as client:
        for victim in (lambda: guardian_of(server), lambda: server):
            drive(client, robot)
            victim().kill()
            wait_until(lambda: robot.has_stopped)


def test_acts_are_refused_while_the_guardian_is_suspended_and_a_new_one_stops_the_robot(
    serve: Serve, robot: Robot
) -> None:
    server, url = serve(LONG_S)
    with RosbridgeClient(url) as client:
        drive(client, robot)
        suspended = guardian_of(server)
        suspended.suspend()

        def is_refused() -> bool:
            client.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
            client.send("call_service", service="/rosapi/topics", id="after")
            found = iter(client.receive, None)
            answers = list(itertools.takewhile(lambda each: each["op"] != "service_response", found))
            return any("has not answered for" in each.get("msg", "") for each in answers)

        wait_until(is_refused)
        wait_until(lambda: robot.has_stopped)
        assert not suspended.is_running() or suspended.status() == psutil.STATUS_ZOMBIE
        drive(client, robot)
        server.kill()
        wait_until(lambda: robot.has_stopped)


def test_a_robot_stops_when_a_page_is_closed(ros: RosSystem, serve: Serve, robot: Robot) -> None:
    server, _ = serve(LONG_S)
    with Page.of(server).connect() as browser:
        view = browser.watch(
            "publishing", name="/cmd_vel", type="geometry_msgs/Twist", message=DRIVE, rate=20
        )
        wait_until(lambda: next(view)["count"] and robot.is_driving)
        browser.socket.socket.shutdown(socket.SHUT_RDWR)
        wait_until(lambda: robot.has_stopped)


def test_a_robot_stops_when_a_foxglove_client_leaves(serve: Serve, robot: Robot) -> None:
    channel = {"id": 1, "topic": "/cmd_vel", "encoding": "json", "schemaName": "geometry_msgs/Twist"}
    with connected(serve(LONG_S)[1]) as client:
        client.send("advertise", channels=[channel])

        def drives() -> bool:
            client.socket.send(b'\x01\x01\0\0\0{"linear": {"x": 0.2}}')
            return robot.is_driving

        wait_until(drives)
    wait_until(lambda: robot.has_stopped)


JUMP = """
import sys, time
began, now, now_ns = time.time(), time.time, time.time_ns
hours = lambda: 3600 * (now() - began > 1)
time.time = lambda: now() + hours()
time.time_ns = lambda: now_ns() + int(hours() * 1e9)
from pipros_tools.cli.pipros import main
sys.exit(main(sys.argv[1:]))
"""


def test_a_robot_stops_although_the_clock_of_the_server_jumps(
    ros: RosSystem, robot: Robot, tmp_path: Path
) -> None:
    (tmp_path / "p.yaml").write_text(POLICY.format(limit=f"time_limit_s: {SHORT_S}"))
    program = ros.pipros.start(
        *(sys.executable, "-c", JUMP, "serve", "--port", "0", "--control", "--policy", tmp_path / "p.yaml")
    )
    with RosbridgeClient(program.wait_for(r"ws://\S+")[0]) as client:
        for _ in range(3):
            drive(client, robot)
            wait_until(lambda: robot.has_stopped)


def test_a_goal_is_cancelled_by_its_id_when_its_time_has_passed(serve: Serve, robot: Robot) -> None:
    with RosbridgeClient(serve(SHORT_S)[1]) as client:
        topic = {"topic": "/fibonacci/goal", "type": "actionlib_tutorials/FibonacciActionGoal"}
        client.send("advertise", **topic)
        client.send("publish", **topic, msg={"goal": {"order": 3}})
        assert "goal_id.id must not be empty" in client.wait_for("status")["msg"]
        # The refused goal has not counted.
        client.send("publish", **topic, msg={"goal_id": {"id": "mine"}, "goal": {"order": 3}})
        wait_until(lambda: robot.cancelled == ["mine"] * REPETITIONS)


@pytest.mark.parametrize("limit_s", [SHORT_S, LONG_S])
def test_a_robot_stops_when_the_last_goal_is_over_or_its_time_has_passed(
    ros: RosSystem, robot: Robot, limit_s: float
) -> None:
    policy = parse_policy(HALTING.format(limit_s=limit_s), "policy.yaml")
    goal: Any = load_message_class("actionlib_tutorials/FibonacciActionGoal")
    result: Any = load_message_class("actionlib_tutorials/FibonacciActionResult")
    results = robot.node.advertise("/fibonacci/result", result, queue_size=10)
    with Node("server", environment=Environment(master_uri=ros.master_uri)) as node:
        gate = ActGate(node, policy)
        client = gate.advertise("/fibonacci/goal", goal)
        for name in ("one", "two"):
            message = goal()
            message.goal_id.id = name
            client.publish(message)
        robot.speed = 0.2  # the action server drives, and refuses or ends both goals without a stop
        if limit_s == LONG_S:
            wait_until(lambda: results.connection_count)

            def ends(name: str) -> None:
                message = result()
                message.status.goal_id.id = name
                results.publish(message)

            ends("one")
            ends("foreign")
            ends("two")
        wait_until(lambda: robot.stops == REPETITIONS * (1 if limit_s == LONG_S else 2))
        assert robot.has_stopped
        assert bool(robot.cancelled) == (limit_s == SHORT_S)
        gate.close()


def test_the_change_after_the_stop_of_a_client_that_left_is_limited(ros: RosSystem, robot: Robot) -> None:
    policy = parse_policy(
        "topics:\n  /cmd_vel:\n    type: geometry_msgs/Twist\n    time_limit_s: 60\n"
        "    fields: {linear.x: {range: [0, 1], change_per_s: 0.1}}\n",
        "policy.yaml",
    )
    now_s = 0.0
    with Node("server", environment=Environment(master_uri=ros.master_uri)) as node:
        gate = ActGate(node, policy, clock_s=lambda: now_s)
        client = gate.advertise("/cmd_vel", TWIST)
        wait_until(lambda: client.connection_count)
        for step in range(1, 4):
            now_s = step
            client.publish(TWIST(linear=VECTOR(step / 10, 0, 0)))
        client.unregister()
        wait_until(lambda: robot.stops)
        now_s += 0.5
        client = gate.advertise("/cmd_vel", TWIST)
        with pytest.raises(ActRefused, match=r"got 0\.3 after 0"):
            client.publish(TWIST(linear=VECTOR(0.3, 0, 0)))
        client.publish(TWIST(linear=VECTOR(0.05, 0, 0)))
        gate.close()


def test_a_stop_that_failed_leaves_the_time_limit_in_force(ros: RosSystem, robot: Robot) -> None:
    text = (
        f"topics:\n  /cmd_vel:\n    type: geometry_msgs/Twist\n    time_limit_s: {SHORT_S}\n    fields: any\n"
    )
    with Node("server", environment=Environment(master_uri=ros.master_uri)) as node:
        gate = ActGate(node, parse_policy(text, "p.yaml"))
        client: Any = gate.advertise("/cmd_vel", TWIST)
        wait_until(lambda: client.connection_count)
        client.publish(TWIST(linear=VECTOR(0.1, 0, 0)))
        wait_until(lambda: robot.is_driving)

        def fails(_: Any) -> None:
            raise ConnectionError("not sent")

        client._publisher.publish = fails
        with pytest.raises(ConnectionError):
            client.publish(TWIST())
        wait_until(lambda: robot.has_stopped)
        gate.close()


def test_a_topic_with_a_time_limit_cannot_be_latched(serve: Serve, robot: Robot) -> None:
    with RosbridgeClient(serve(LONG_S)[1]) as client:
        client.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist", latch=True)
        assert "/cmd_vel has a time limit, so it cannot be latched" in client.wait_for("status")["msg"]
        drive(client, robot)
        client.send("publish", topic="/cmd_vel", msg={}, latch=True)
        assert "/cmd_vel has a time limit, so it cannot be latched" in client.wait_for("status")["msg"]


def test_a_client_that_stops_the_robot_ends_the_time_limit(serve: Serve, robot: Robot) -> None:
    server, url = serve(LONG_S)
    with RosbridgeClient(url) as client:
        drive(client, robot)
        client.send("publish", topic="/cmd_vel", msg={})
        client.call("/rosapi/topics")  # after the response, the guardian knows, too
        wait_until(lambda: robot.has_stopped)
        guardian = guardian_of(server)
        server.kill()
        wait_until(lambda: not guardian.is_running())
        assert robot.stops == 1
