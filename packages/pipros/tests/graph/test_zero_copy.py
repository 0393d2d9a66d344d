"""`rospy.Subscriber(..., zero_copy=True)`: the documented example, `numpy_msg`, and genuine rospy."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support import documents
from tests.support.ros import RosSystem, Side

EXAMPLE = re.search(r"```python\n(.*?)```", documents.text_of("guides/libraries.md"), re.DOTALL)

PUBLISH = """
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import Float32MultiArray
rospy.init_node("camera")
publishers = [rospy.Publisher("camera/image_raw", Image, queue_size=10),
              rospy.Publisher("numbers", Float32MultiArray, queue_size=10)]
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    publishers[0].publish(Image(encoding="mono8", data=b"\\x05" * 200_000))
    publishers[1].publish(Float32MultiArray(data=[0.5] * 50_000))
    rate.sleep()
"""

NUMBERS = """
import rospy, numpy
from rospy.numpy_msg import numpy_msg
from std_msgs.msg import Float32MultiArray
rospy.init_node("reader")
kept = []
def read(message):
    kept.append(message.data[::2])
    if len(kept) == 8:
        assert all((array == 0.5).all() and not array.flags.writeable for array in kept)
        print(len(kept), kept[0].dtype, kept[0].shape, flush=True)
rospy.Subscriber("numbers", numpy_msg(Float32MultiArray), read, zero_copy=True)
rospy.spin()
"""


def run(side: Side, folder: Path, name: str, code: str, expected: str) -> None:
    python = "/usr/bin/python3" if side.is_genuine else "python"
    (folder / name).write_text(code)
    side.start(python, folder / name, PYTHONUNBUFFERED="1").wait_for(expected)


def test_the_documented_example_runs(ros: RosSystem) -> None:
    assert EXAMPLE
    ros.serve_master()
    (ros.home / "camera.py").write_text(PUBLISH)
    ros.pipros.start("python", ros.home / "camera.py")
    run(ros.pipros, ros.home, "viewer.py", EXAMPLE[1], "^mono8 200000 5$")


@pytest.mark.skipif(not Path("/usr/lib/python3/dist-packages/rospy").exists(), reason="needs genuine rospy")
def test_the_documented_example_runs_on_genuine_rospy(ros: RosSystem) -> None:
    assert EXAMPLE
    ros.serve_master()
    (ros.home / "camera.py").write_text(PUBLISH)
    ros.pipros.start("python", ros.home / "camera.py")
    run(ros.genuine, ros.home, "viewer.py", EXAMPLE[1], "^mono8 200000 5$")


def test_numpy_msg_gets_numbers_without_a_copy(ros: RosSystem) -> None:
    ros.serve_master()
    (ros.home / "camera.py").write_text(PUBLISH)
    ros.pipros.start("python", ros.home / "camera.py")
    run(ros.pipros, ros.home, "reader.py", NUMBERS, r"^8 float32 \(25000,\)$")
