"""A graph on a system without the modules and functions of POSIX, such as Windows."""

from __future__ import annotations

from tests.support.without_posix import run_without_posix

GRAPH = """
import os, threading
from pipros_tools.cli import rosmsg, rosnode, rosparam, rosservice, rostopic
from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from std_msgs.msg import String

with Master(port=0) as master, Node("node", environment=Environment(master_uri=master.uri)) as node:
    arrived = threading.Event()
    node.subscribe("/chat", String, lambda message: arrived.set())
    node.advertise("/chat", String, latch=True).publish(String("x"))
    assert arrived.wait(30)
    os.environ["ROS_MASTER_URI"] = master.uri
    for command, arguments in (
        (rostopic, ["list"]),
        (rosnode, ["list"]),
        (rosservice, ["list"]),
        (rosparam, ["set", "/speed", "5"]),
        (rosparam, ["get", "/speed"]),
        (rosmsg, ["show", "std_msgs/String"]),
    ):
        assert command.main(arguments) == 0
"""


def test_nodes_and_queries_work_without_posix() -> None:
    shown = run_without_posix(GRAPH).split()
    assert shown[:2] == ["/chat", "/node"]
    assert shown[-3:] == ["5", "string", "data"]
