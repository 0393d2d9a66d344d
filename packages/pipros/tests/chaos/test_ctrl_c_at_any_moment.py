"""Ctrl-C at any moment of the start: one is enough, and no process or registration is left.

A signal that arrives just before the main thread begins to wait is handled only when that wait ends, so no
wait of the main thread may be endless. The moments below are spread over the start, and the last of them are
those in which the waits begin. `test_ctrl_c_at_any_byte_code.py` tests these in detail.
"""

from __future__ import annotations

import pytest

from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LAUNCH = ("roslaunch", "composiv_tryouts", "composiv_tryout.launch")
MOMENTS = (
    "... logging to",
    "Press Ctrl-C to interrupt",
    "started roslaunch server",
    "auto-starting new master",
    "setting /run_id",
    "started core service",
    "process\\[talker-2\\]",
    "process\\[listener-3\\]",
    "SyntaxWarning",
)
ENDS_WITHIN_S = 30.0
"""Half a second is promised; this test looks for waits that never end."""


def end(ros: RosSystem, launch: Process) -> None:
    launch.press_ctrl_c()
    code = launch.wait(ENDS_WITHIN_S)
    assert code == 0, launch.output
    assert "escalating" not in launch.output
    ros.pipros.processes.assert_nothing_left()


@pytest.mark.parametrize("moment", MOMENTS)
def test_roslaunch_ends_at_this_moment_of_its_start(ros: RosSystem, moment: str) -> None:
    launch = ros.pipros.start(*LAUNCH)
    launch.wait_for(moment)

    end(ros, launch)


@pytest.mark.parametrize("attempt", range(6))
def test_roslaunch_ends_when_its_nodes_begin_to_wait(ros: RosSystem, attempt: int) -> None:
    launch = ros.pipros.start(*LAUNCH)
    wait_until(
        lambda: ros.publishers("/battery_topic") and ros.subscribers("/battery_topic"),
        60,
        what=lambda: f"talker and listener are not there:\n{launch.output}",
    )

    end(ros, launch)


@pytest.mark.parametrize("attempt", range(6))
def test_a_listener_ends_when_it_begins_to_wait(ros: RosSystem, attempt: int) -> None:
    ros.pipros.start_master()
    listener = ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py")
    ros.wait_for_subscriber("/battery_topic", 60)

    listener.press_ctrl_c()

    assert listener.wait(ENDS_WITHIN_S) == 0, listener.output
