"""A source of velocities that falls silent, or sends invalid ones, does not leave a robot driving."""

import math
from typing import Any

import pytest
from geometry_msgs.msg import Twist

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_libraries.nodes.velocities import VelocityOutput
from pipros_libraries.teleoperation.twist_mux_node import TwistMux
from pipros_libraries.teleoperation.velocity_mux import VelocityMux, VelocitySource
from pipros_robot.navigation.velocities.velocity_smoother import Feedback, VelocityLimits, VelocitySmoother
from pipros_robot.navigation.velocities.velocity_smoother_node import SmootherNode
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def driving() -> Any:
    twist = Twist()
    twist.linear.x = 0.2
    return twist


def test_twist_mux_stops_a_robot_whose_source_falls_silent(ros: RosSystem) -> None:
    ros.serve_master()
    with ros.node("mux") as node:
        TwistMux(node, [VelocitySource("a", "/a", 0.2, 10)], [])
        with ros.node("robot") as robot:
            inbox = Inbox.of(robot, "/cmd_vel_out", Twist)
            source = robot.advertise("/a", Twist, queue_size=1)
            wait_until(lambda: source.connection_count)

            def drives() -> bool:
                source.publish(driving())
                return bool(inbox.messages)

            wait_until(drives)
            wait_until(lambda: inbox.messages[-1] == Twist())
            assert inbox.messages.count(Twist()) == 1


def test_twist_mux_stops_a_robot_whose_source_has_ended_also_without_a_timeout(ros: RosSystem) -> None:
    ros.serve_master()
    with ros.node("mux") as node:
        TwistMux(node, [VelocitySource("a", "/a", 0.0, 10)], [])
        with ros.node("robot") as robot:
            inbox = Inbox.of(robot, "/cmd_vel_out", Twist)
            with ros.node("source") as other:
                source = other.advertise("/a", Twist, queue_size=1)
                wait_until(lambda: source.connection_count)
                wait_until(lambda: source.publish(driving()) or inbox.messages)
            wait_until(lambda: inbox.messages[-1] == Twist())


def test_a_lock_stops_a_robot_at_once_and_holds_it(ros: RosSystem) -> None:
    ros.serve_master()
    flag: Any = load_message_class("std_msgs/Bool")
    with ros.node("mux") as node:
        TwistMux(node, [VelocitySource("a", "/a", 0.0, 10)], [VelocitySource("estop", "/estop", 0.0, 255)])
        with ros.node("robot") as robot:
            inbox = Inbox.of(robot, "/cmd_vel_out", Twist)
            source, lock = (
                robot.advertise(*each, queue_size=1) for each in (("/a", Twist), ("/estop", flag))
            )
            wait_until(lambda: source.connection_count and lock.connection_count)

            def drives() -> bool:
                source.publish(driving())
                return bool(inbox.messages)

            wait_until(drives)
            lock.publish(flag(True))
            wait_until(lambda: inbox.messages[-3:] == [Twist()] * 3)


@pytest.mark.parametrize("begins", [True, False])
def test_a_robot_is_stopped_if_the_simulated_time_has_ended_or_never_begins(
    ros: RosSystem, begins: bool, capfd: pytest.CaptureFixture[str]
) -> None:
    ros.serve_master()
    kind: Any = load_message_class("rosgraph_msgs/Clock")
    with ros.node("teleop") as node, ros.node("robot") as robot:
        clock = node.use_simulated_time()
        output = VelocityOutput(node, "cmd_vel", silence_s=0.5)
        inbox = Inbox.of(robot, "/cmd_vel", Twist)
        wait_until(lambda: output.connection_count)
        if begins:
            with ros.node("simulator") as other:
                times = other.advertise("/clock", kind, queue_size=1)
                wait_until(lambda: times.publish(kind(Time(5))) or clock.now_ns())
        output.publish(driving())
        wait_until(lambda: inbox.messages == [driving(), Twist()])
    assert "nobody publishes /clock" in capfd.readouterr().err


def test_a_node_that_ends_stops_the_robot(ros: RosSystem) -> None:
    ros.serve_master()
    with ros.node("robot") as robot:
        inbox = Inbox.of(robot, "/cmd_vel", Twist)

        def drive_and_fail() -> None:
            with ros.node("driver") as node:
                output = VelocityOutput(node, "/cmd_vel")
                wait_until(lambda: output.connection_count)
                output.publish(driving())
                node.on_shutdown(lambda: output.publish(driving()))  # too late
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            drive_and_fail()
        wait_until(lambda: inbox.messages == [driving(), Twist()])


def test_twist_mux_stops_no_robot_while_another_source_is_in_charge() -> None:
    first, second = VelocitySource("a", "/a", 0.3, 20), VelocitySource("b", "/b", 1.0, 10)
    mux = VelocityMux([first, second], [])
    assert mux.passes(first, 0.1)
    mux.passes(second, 0.2)
    assert mux.in_charge(first, 0.3) is first
    assert mux.in_charge(first, 0.5) is second
    assert mux.in_charge(second, 1.0) is second
    assert mux.in_charge(second, 1.5) is None


def test_a_measured_velocity_that_is_not_finite_does_not_become_a_command() -> None:
    one = VelocitySmoother(VelocityLimits(), 0.1, Feedback.ODOMETRY, lambda level, text: None)
    one.command((0.5, 0.0), 1.0)
    for wrong in ((math.inf, 0.0), (0.0, math.nan), (-math.inf, math.inf)):
        one.measured(wrong)
        found = one.step(1.0)
        assert 0 < found[0] <= 0.5
        assert found[1] == 0


def test_a_failing_smoother_stops_the_robot_and_goes_on(ros: RosSystem, monkeypatch) -> None:
    ros.serve_master()

    def fails(*_: Any) -> Any:
        raise ZeroDivisionError("a defect")

    with ros.node("smoother") as node:
        inbox = Inbox.of(node, "~smooth_cmd_vel", Twist)
        commands = node.advertise("~raw_cmd_vel", Twist, queue_size=1)
        smoother = SmootherNode(node)

        def moves() -> bool:
            commands.publish(driving())
            return bool(inbox.messages) and inbox.messages[-1].linear.x > 0

        wait_until(moves)
        with monkeypatch.context() as patch:
            patch.setattr(VelocitySmoother, "step", fails)
            wait_until(lambda: inbox.messages[-1].linear.x == 0)
        wait_until(moves)
        smoother.close()
