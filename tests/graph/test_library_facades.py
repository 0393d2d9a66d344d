"""The libraries above rospy with a node, one script each, in a process of its own."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.processes import Processes

HEAD = """
import threading
import rospy

def wait_for(condition):
    for _ in range(3000):
        if condition():
            return
        threading.Event().wait(0.01)
    raise SystemExit("what was waited for did not happen")

rospy.init_node("node")
"""

SYNCHRONIZED = """
import message_filters
from sensor_msgs.msg import CameraInfo, Image
subscribers = [message_filters.Subscriber("image", Image, queue_size=5)]
subscribers.append(message_filters.Subscriber("info", CameraInfo))
both = message_filters.ApproximateTimeSynchronizer(subscribers, 5, 0.1)
got = []
both.registerCallback(lambda image, info, more: got.append((image.width, info.width, more)), "more")
types = {"image": Image, "info": CameraInfo}
publishers = [rospy.Publisher(name, cls, queue_size=5) for name, cls in types.items()]
wait_for(lambda: all(publisher.get_num_connections() for publisher in publishers))
for publisher, message in zip(publishers, (Image(width=4), CameraInfo(width=5))):
    message.header.stamp = rospy.Time(10, len(got))
    publisher.publish(message)
wait_for(lambda: got)
one, other = subscribers
print(got, one.getTopic(), one.resolved_name, other.get_num_connections())
"""


@pytest.mark.parametrize(
    ("script", "expected"),
    [pytest.param(SYNCHRONIZED, ["[(4, 5, 'more')] image /image 1"], id="synchronized topics")],
)
def test_a_script_prints(script: str, expected: list[str], master: Master, tmp_path: Path) -> None:
    file = tmp_path / "script.py"
    file.write_text(HEAD + script)
    processes = Processes(
        {"ROS_MASTER_URI": master.uri, "ROS_HOME": str(tmp_path), "PATH": "/usr/bin:/bin"}, tmp_path
    )
    try:
        ended = processes.run(sys.executable, file)
    finally:
        processes.end_all()

    assert ended.stdout == expected, ended.output
