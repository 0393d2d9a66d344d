"""ros_comm#2236: rosbag failed at its end if the shell that started it had set SIGINT to be ignored.

Shells do so for jobs in the background of a script. Python then has a number instead of a handler.
"""

from __future__ import annotations

import signal

import pytest

from pipros_tools.bag.reader import BagReader
from tests.support.ros import RosSystem


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recording_in_the_background_ends_without_an_error(ros: RosSystem, number: int) -> None:
    ros.serve_master()
    talker = ros.pipros.start_node("rospy_tutorials", "talker.py")
    recording = ros.pipros.start(
        "sh", "-c", "trap '' INT; exec rosbag record -O recorded.bag --duration 600 /chatter"
    )
    ros.wait_for_subscriber("/chatter")
    ros.wait_for_links("/chatter")
    recording.send_signal(number)
    assert recording.wait() == 0, recording.output
    assert "Traceback" not in recording.output
    with BagReader(ros.home / "recorded.bag") as bag:
        assert bag.layout is not None
    talker.press_ctrl_c()
