"""ros_comm#222: a topic is listed, but no message arrives, and no tool says why.

Requested in 2013: report that a publisher cannot be reached, because its host name is unknown here.
"""

from __future__ import annotations

from typing import Any

from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from tests.support.nodes import MakeNode, listening_log
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")


def test_a_publisher_with_an_unknown_host_name_is_explained_once(make_node: MakeNode, master: Master) -> None:
    ghost = MasterClient(master.uri, "/camera")
    ghost.register_publisher("/image", "std_msgs/String", "http://no-such-robot.invalid:1234/")
    log, lines = listening_log()
    node = make_node("viewer", log=log)
    node.subscribe("/image", String, print)
    wait_until(lambda: lines)
    assert "cannot receive [/image] from the publisher at http://no-such-robot.invalid:1234/" in lines[0]
    assert "set ROS_IP on the node's machine" in lines[0]
    subscription = node.endpoints.subscription("/image")
    assert subscription is not None
    attempts = subscription.attempts
    wait_until(lambda: subscription.attempts > attempts + 1)
    assert len(lines) == 1
    ghost.close()


def test_a_publisher_on_a_closed_port_is_explained(make_node: MakeNode, master: Master) -> None:
    ghost = MasterClient(master.uri, "/camera")
    ghost.register_publisher("/image", "std_msgs/String", "http://127.0.0.1:1/")
    log, lines = listening_log()
    make_node("viewer", log=log).subscribe("/image", String, print)
    wait_until(lambda: lines)
    assert "Connection refused. That address is local: the node has ended" in lines[0]
    ghost.close()
