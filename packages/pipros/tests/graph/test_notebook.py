"""Notebooks: nodes in cells that run again; the notebook of the documents runs from a clean state."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import nbformat
import pytest

from tests.support.notebook import NOTEBOOK, run_notebook
from tests.support.ros import RosSystem

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


def test_a_node_survives_cells_that_run_again_also_with_another_name(
    ros: RosSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ros.serve_master()
    monkeypatch.setenv("ROS_MASTER_URI", ros.master_uri)
    cells = [nbformat.v4.new_code_cell(each) for each in CELLS.split("\n\n")]
    found = run_notebook(tmp_path, nbformat.v4.new_notebook(cells=cells))
    printed = "".join(
        each.text for cell in found.cells for each in cell.outputs if each.get("name") == "stdout"
    )
    assert printed == "/second again\nafter an interrupt\n"
