"""Nodes and notebooks of the documents run."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage

from cv_bridge import CvBridge
from pipros.msg import load_message_class
from tests.support import documents
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.notebook import NOTEBOOK, run_notebook
from tests.support.ros import RosSystem, Side
from tests.tutorial.test_docs import BLOCK

# Nodes of docs/guides/libraries.md: the test of one passes, and they run as programs.


BLOCKS = BLOCK.findall(documents.text_of("guides/libraries.md"))
FILES = {title: content for _, title, content in BLOCKS if title.endswith("nearest.py")}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, content in FILES.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    return tmp_path


def test_the_example_is_short_and_its_test_passes(folder: Path) -> None:
    assert sum(bool(line) for content in FILES.values() for line in content.splitlines()) <= 30
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_nearest.py"]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)

    assert "1 passed" in ended.stdout, ended.stdout + ended.stderr


def test_the_example_is_a_program(folder: Path, ros: RosSystem) -> None:
    ros.serve_master()
    node = ros.pipros.start("python3", folder / "nearest.py", "_limit:=1")
    ros.wait_for_subscriber("/scan")
    scan = "{range_min: 0.5, ranges: [2.0, 0.1, 0.75], header: {frame_id: laser}}"
    ros.pipros.start("rostopic", "pub", "-r", "10", "scan", "sensor_msgs/LaserScan", scan)
    echo = ros.pipros.run("rostopic", "echo", "-n", "1", "nearest")

    assert "range: 0.75" in echo.output
    node.press_ctrl_c(code=0)


def test_the_example_halves_compressed_images(ros: RosSystem) -> None:
    (code,) = (content for _, title, content in BLOCKS if title == "shrink.py")
    (ros.home / "shrink.py").write_text(code)
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:] = (200, 100, 50)
    whole = CvBridge().cv2_to_compressed_imgmsg(picture, "png")
    ros.serve_master()
    inbox = Inbox()
    with ros.node("camera") as camera:
        camera.subscribe("/camera/small/compressed", CompressedImage, inbox)
        camera.advertise("/camera/image_raw/compressed", CompressedImage, latch=True).publish(whole)
        ros.pipros.start("python3", ros.home / "shrink.py")
        small = CvBridge().compressed_imgmsg_to_cv2(inbox.wait()[0], "bgr8")
    assert small.shape == (24, 32, 3)
    assert np.abs(small.astype(int) - (200, 100, 50)).max() <= 4


def test_the_nodelet_publishes_the_mean_of_each_image(make_node: MakeNode) -> None:
    (code,) = (content for _, _, content in BLOCKS if "class Brightness" in content)
    names: dict[str, Any] = {
        each: load_message_class(f"{package}/{each}")
        for package, each in (("std_msgs", "Float32"), ("sensor_msgs", "Image"))
    }
    exec(code, names)  # noqa: S102 # our own document
    nodelet = names["Brightness"](make_node("brightness"))
    inbox = Inbox()
    wait_until_connected(make_node("reader").subscribe("/brightness/mean", names["Float32"], inbox))

    make_node("camera").advertise("image", names["Image"], latch=True).publish(names["Image"](data=b"\1\3"))

    assert inbox.wait()[0].data == 2.0
    nodelet.close()


# `rospy.Subscriber(..., zero_copy=True)`: the documented example, `numpy_msg`, and genuine rospy.


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


# Notebooks: nodes in cells that run again; the notebook of the documents runs from a clean state.


PICTURE = '<img src="data:image/'


def outputs(cell: Any) -> list[tuple[str, ...]]:
    """Return what kinds of output a cell has."""
    return [(each.output_type, *sorted(each.get("data", {}))) for each in cell.get("outputs", ())]


def test_the_notebook_of_the_documentation_runs_from_a_clean_state(tmp_path: Path) -> None:
    stored = nbformat.read(NOTEBOOK, as_version=4)
    found = run_notebook(tmp_path)
    assert [outputs(each) for each in found.cells] == [outputs(each) for each in stored.cells]
    shown = [
        each.data.get("text/html", "")
        for cell in found.cells
        for each in cell.get("outputs", ())
        if "data" in each
    ]
    assert PICTURE in shown[0]
    row = r">/odom</td><td>nav_msgs/Odometry</td><td>\d\d\d</td>"
    assert re.search(rf"<caption [^>]*>drive.bag .*{row}", "".join(shown))


CELLS = """\
import asyncio, rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse
assert asyncio.get_running_loop().is_running()

rospy.init_node("first")
received = []
subscriber = rospy.Subscriber("/chatter", String, received.append)
publisher = rospy.Publisher("/chatter", String, latch=True, queue_size=1)
server = rospy.Service("/work", Trigger, lambda _: TriggerResponse(True, "done"))

rospy.init_node("first")
publisher.publish("hello")
assert rospy.wait_for_message("/chatter", String, 60).data == "hello"
assert rospy.ServiceProxy("/work", Trigger)().message == "done"

rospy.init_node("second")
publisher = rospy.Publisher("/chatter", String, latch=True, queue_size=1)
publisher.publish("again")
print(rospy.get_name(), rospy.wait_for_message("/chatter", String, 60).data)

import os, signal, threading
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    rospy.spin()
    rospy.sleep(60)
except (KeyboardInterrupt, rospy.ROSInterruptException):
    pass

rospy.init_node("second")
publisher = rospy.Publisher("/chatter", String, latch=True, queue_size=1)
publisher.publish("after an interrupt")
print(rospy.wait_for_message("/chatter", String, 60).data)

from pipros import Node, load_message_class
with Node("third") as node:
    assert "/second" in [name for _, names in node.master.get_system_state()[0] for name in names]
rospy.signal_shutdown("the end")
"""


def test_a_node_survives_cells_that_run_again_also_with_another_name(ros, tmp_path, monkeypatch) -> None:
    ros.serve_master()
    monkeypatch.setenv("ROS_MASTER_URI", ros.master_uri)
    cells = [nbformat.v4.new_code_cell(each) for each in CELLS.split("\n\n")]
    found = run_notebook(tmp_path, nbformat.v4.new_notebook(cells=cells))
    printed = "".join(
        each.text for cell in found.cells for each in cell.outputs if each.get("name") == "stdout"
    )
    assert printed == "/second again\nafter an interrupt\n"
