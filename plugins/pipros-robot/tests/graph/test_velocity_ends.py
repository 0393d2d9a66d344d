"""What left a robot driving in real systems: a closed terminal, a lock, and a stream of goals."""

import signal

import pytest

from tests.support.motion_processes import Base, Running
from tests.support.moving_programs import send_goal
from tests.support.ros import RosSystem
from tests.support.unlinked_node import message
from tests.support.waiting import wait_until


def test_a_terminal_that_is_closed_stops_the_robot(ros: RosSystem) -> None:
    ros.serve_master()
    base = Base(ros.master_uri, "/cmd_vel")
    terminal = ros.pipros.open_terminal()
    terminal.type("rosrun teleop_twist_keyboard teleop_twist_keyboard.py _key_timeout:=0")
    terminal.wait_for("currently:\tspeed 0.5\tturn 1.0")
    wait_until(lambda: terminal.press_in_program("i") or base.greatest() == 0.5)
    terminal.hang_up()
    wait_until(lambda: base.greatest() == 0)
    base.close()


def test_a_lock_of_twist_mux_stops_the_robot_and_holds_it(ros: RosSystem) -> None:
    ros.serve_master()
    with Running(ros, "twist_mux") as running:
        running.drives()
        running.sources.every(
            0.1, lambda: running.sources.give("/estop", message("std_msgs/Bool", data=True))
        )
        wait_until(lambda: running.base.greatest(3) == 0, what="three zeros")


@pytest.mark.parametrize("number", [signal.SIGQUIT, signal.SIGUSR1, signal.SIGXCPU])
def test_signals_that_kill_a_program_stop_the_robot_first(ros: RosSystem, number: int) -> None:
    ros.serve_master()
    with Running(ros, "twist_mux") as running:
        running.drives()
        running.process.send_signal(number)
        running.stops()
        assert running.process.wait() is not None


def test_a_suspended_program_stops_the_robot_first_and_drives_on_afterwards(ros: RosSystem) -> None:
    ros.serve_master()
    with Running(ros, "twist_mux") as running:
        for _ in range(2):
            running.drives()
            running.process.send_signal(signal.SIGTSTP)
            running.stops()
            running.process.send_signal(signal.SIGCONT)
            count = len(running.base.sent)
            wait_until(lambda count=count: len(running.base.sent) > count + 5)


def test_a_stream_of_goals_faster_than_the_control_period_keeps_the_robot_driving(ros: RosSystem) -> None:
    ros.serve_master()
    with Running(ros, "move_base", controller_frequency=5.0) as running:
        running.drives()
        running.sources.every(0.1, lambda: send_goal(running.sources, 2.5))
        count = len(running.base.sent)
        wait_until(lambda: len(running.base.sent) > count + 10, what="commands")
        assert running.base.greatest(10) > 0
