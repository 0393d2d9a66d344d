"""Whatever a driving robot is told, it stops within a control period, or reaches its goal."""

import itertools
import logging
import math
import random
import re
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros_robot.navigation.dwa.dwa_node import DwaLocalPlanner
from pipros_robot.navigation.move_base.move_base_node import MoveBase
from pipros_robot.navigation.move_base.recovery import Rotate
from pipros_robot.navigation.navfn.navfn_node import NavfnPlanner
from pipros_robot.navigation.world import NavigationWorld
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.edge_values import edge_messages
from tests.support.ros import RosSystem
from tests.support.unlinked_node import message, posed, scan, transforms

APARTMENT = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml")
START, KITCHEN, STUDY = (2.9, 1.0, 1.2), (7.8, 1.5, 0.0), (7.4, 5.9, -0.8)
POSE: Any = load_message_class("geometry_msgs/PoseStamped")
PREEMPTED, SUCCEEDED, ABORTED = 2, 3, 4
PERIODS_S = 0.5
"""Simulated time of a few control periods of 0.1 s, with the messages between the nodes."""


class Drive:
    """A robot on its way to the kitchen.

    Attributes:
        commands: the speeds that move_base has sent, forward or turning.
        statuses: the results of its goals.
    """

    def __init__(self, world: NavigationWorld) -> None:
        self.world = world
        self.commands: list[float] = []
        self.statuses: list[int] = []
        node = world.node
        node.subscribe("/cmd_vel", load_message_class("geometry_msgs/Twist"), self._note, queue_size=100)
        result = load_message_class("move_base_msgs/MoveBaseActionResult")
        node.subscribe("/move_base/result", result, lambda m: self.statuses.append(m.status.status))
        self._goals = node.advertise("/move_base_simple/goal", POSE, queue_size=1)
        world.send_goal(*KITCHEN)
        world.run_for(3.0)
        assert abs(self.commands[-1]) > 0.1

    def _note(self, message: Any) -> None:
        self.commands.append(message.linear.x or message.angular.z)

    def send(self, change: Callable[[Any], None]) -> None:
        """Send a goal that differs from one in the study, and let a few control periods pass."""
        goal = POSE()
        goal.header.frame_id = "map"
        goal.pose.position.x, goal.pose.position.y = STUDY[:2]
        goal.pose.orientation.w = 1.0
        change(goal)
        self._goals.publish(goal)
        self.world.run_for(PERIODS_S)

    def runs_until(self, condition: Callable[[], bool]) -> None:
        """Let simulated time pass until a condition holds, at most 90 s."""
        for _ in range(90):
            if condition():
                return
            self.world.run_for(1.0)
        raise AssertionError(f"not within 90 s: {self.commands[-1]}, {self.statuses}")

    def reaches_the_study(self) -> None:
        """Send another goal, and wait until the robot has reached it."""
        self.world.send_goal(*STUDY)
        self.runs_until(lambda: SUCCEEDED in self.statuses)


@pytest.fixture
def drive(ros: RosSystem, caplog: pytest.LogCaptureFixture) -> Iterator[Drive]:
    ros.serve_master()
    caplog.set_level(logging.CRITICAL, "navigation_world")
    with closing(NavigationWorld(ros.master_uri, APARTMENT, start=START)) as made:
        yield Drive(made)


def orientation(**values: float) -> Callable[[Any], None]:
    return lambda goal: [setattr(goal.pose.orientation, *each) for each in values.items()] and None


def position(**values: float) -> Callable[[Any], None]:
    return lambda goal: [setattr(goal.pose.position, *each) for each in values.items()] and None


BAD = {
    "no quaternion": orientation(w=0.0), "nan quaternion": orientation(z=math.nan),
    "infinite quaternion": orientation(x=math.inf), "large quaternion": orientation(w=1e200),
    "lying quaternion": orientation(w=0.0, x=1.0), "nan": position(x=math.nan), "far away": position(x=1e300),
    "off the map": position(y=-500.0), "in a wall": position(x=4.05, y=0.6),
    "unknown frame": lambda goal: setattr(goal.header, "frame_id", "nowhere"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_goal_that_cannot_be_reached_stops_a_driving_robot_at_once(drive: Drive, name: str) -> None:
    drive.send(BAD[name])
    assert drive.commands[-1] == 0
    count, place = len(drive.commands), drive.world.pose
    drive.world.run_for(1.0)
    assert not any(drive.commands[count:])
    assert math.dist(place[:2], drive.world.pose[:2]) < 0.1
    drive.reaches_the_study()


HOSTILE = re.compile(r"nan|inf|e\+308|e\+38|is empty")
"""Changes of fields that make a message hostile; others leave it valid."""


def hostile_messages() -> Iterator[tuple[str, str, Any]]:
    """Yield the topics, changes and values of forty messages that are not goals."""
    odometry = message("nav_msgs/Odometry", "odom", child_frame_id="base_footprint")
    odometry.pose.pose.orientation.w = 1.0
    good = {"scan": scan(), "odom": odometry, "initialpose": posed("map"),
            "tf": transforms("odom", "base_footprint")}  # fmt: skip
    dice = random.Random(1)  # noqa: S311 # no secret
    for topic, one in good.items():
        bad = [each for each in edge_messages(one) if HOSTILE.search(each[0])]
        yield from ((topic, *each) for each in dice.sample(bad, 10))


def test_forty_hostile_messages_end_no_node_and_cause_no_wild_command(drive: Drive) -> None:
    """After any message that is not a goal, the robot stops, or drives within its limits."""
    node, publishers, goals = drive.world.node, {}, itertools.cycle((STUDY, KITCHEN))
    moved = []
    for topic, change, made in hostile_messages():
        if topic not in publishers:
            publishers[topic] = node.advertise(f"/{topic}", type(made), queue_size=10)
        for each in getattr(made, "transforms", [made]):
            each.header.stamp = Time(*divmod(round(drive.world.time_s * 1e9), 1_000_000_000))
        drive.world.send_goal(*next(goals))
        drive.world.run_for(0.6)
        count, place = len(drive.commands), drive.world.pose
        publishers[topic].publish(made)
        drive.world.run_for(0.6)
        new = drive.commands[count:]
        assert new, f"{topic}: {change}"
        assert all(math.isfinite(each) and abs(each) <= 2.0 for each in new), f"{topic}: {change}"
        moved.append(place != drive.world.pose)
    assert sum(moved) > len(moved) / 2
    drive.statuses.clear()
    drive.reaches_the_study()


@pytest.mark.parametrize(("part", "method"), [
    (DwaLocalPlanner, "command"), (DwaLocalPlanner, "is_goal_reached"), (DwaLocalPlanner, "set_plan"),
    (NavfnPlanner, "make_plan"), (MoveBase, "_publish_feedback"), (MoveBase, "_make_plan"),
])  # fmt: skip
def test_an_error_of_the_control_or_the_planner_stops_the_robot_and_not_the_node(
    drive: Drive, monkeypatch: pytest.MonkeyPatch, part: type, method: str
) -> None:
    def fails(*_: Any) -> Any:
        raise ZeroDivisionError("a defect")

    with monkeypatch.context() as patch:
        patch.setattr(part, method, fails)
        drive.send(lambda _: None)  # a new goal needs all parts
        assert drive.commands[-1] == 0
    drive.reaches_the_study()


def test_a_recovery_that_fails_leaves_the_robot_still(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    turns = []

    def fails(self: Any) -> bool:
        turns.append(self)
        self._tools.drive((0.0, 0.0, 0.7))
        raise ValueError("a defect")

    monkeypatch.setattr(Rotate, "recover", fails)
    drive.send(position(y=-500.0))
    drive.runs_until(lambda: drive.statuses[-1:] == [ABORTED])
    assert turns
    assert drive.commands[-1] == 0


def test_a_cancellation_ends_a_turning_recovery(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    def turns(self: Any) -> bool:
        self._tools.drive((0.0, 0.0, 0.7))
        return False

    monkeypatch.setattr(Rotate, "recover", turns)
    cancel: Any = load_message_class("actionlib_msgs/GoalID")
    cancels = drive.world.node.advertise("/move_base/cancel", cancel, queue_size=1)
    drive.send(position(y=-500.0))
    drive.runs_until(lambda: drive.commands[-1] == 0.7)
    cancels.publish(cancel())
    drive.world.run_for(PERIODS_S)
    assert (drive.commands[-1], drive.statuses[-1]) == (0, PREEMPTED)


def test_the_robot_stops_if_its_local_costmap_is_not_updated(drive: Drive) -> None:
    double: Any = load_message_class("dynamic_reconfigure/DoubleParameter")
    reconfigure: Any = load_service_class("dynamic_reconfigure/Reconfigure")
    request = reconfigure._request_class()
    request.config.doubles = [double("update_frequency", 0.0)]
    client = drive.world.node.client("/move_base/local_costmap/set_parameters", reconfigure)
    client.call(request)
    drive.world.run_for(PERIODS_S)
    assert drive.commands[-1] == 0
