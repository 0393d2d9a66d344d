"""ros_comm#152, #149, roslibpy#27, rosbridge_suite#905: calls waited forever, or failed without a reason."""

from __future__ import annotations

import socket
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from pipros.master.master import Master
from pipros.msg import load_service_class
from pipros.net.master_client import MasterClient
from pipros.node.service_link import CallTimeout, ServiceFailed
from tests.support.nodes import MakeNode
from tests.support.processes import Processes

SetBool: Any = load_service_class("std_srvs/SetBool")
Trigger: Any = load_service_class("std_srvs/Trigger")


@pytest.mark.parametrize("persistent", [False, True])
def test_a_call_that_takes_too_long_ends_and_the_next_one_works(
    make_node: MakeNode, persistent: bool
) -> None:
    server, gate = make_node("server"), threading.Event()

    def handle(request: Any) -> Any:
        if request.data:
            gate.wait(60)
        return SetBool._response_class(success=True)

    server.serve("set", SetBool, handle)
    client = make_node("client").client("set", SetBool, persistent=persistent)
    with pytest.raises(CallTimeout, match=r"service \[/set\] did not answer in time"):
        client.call(SetBool._request_class(data=True), 0.05)
    assert client.call(SetBool._request_class(data=False), 30).success
    client.close()
    gate.set()


def test_a_server_that_accepts_and_never_responds_times_out(make_node: MakeNode, master: Master) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        register = MasterClient(master.uri, "/silent")
        register.register_service(
            "/set", f"rosrpc://127.0.0.1:{silent.getsockname()[1]}", "http://127.0.0.1:1/"
        )
        register.close()
        with pytest.raises(CallTimeout):
            make_node("client").client("set", SetBool).call(SetBool._request_class(), 0.05)


def test_a_wrong_type_is_named(make_node: MakeNode) -> None:
    make_node("server").serve("set", SetBool, lambda _: SetBool._response_class())
    client = make_node("client").client("set", Trigger)
    with pytest.raises(ServiceFailed, match="md5sum") as caught:
        client.call(Trigger._request_class(), 30)
    assert SetBool._md5sum in str(caught.value)
    assert Trigger._md5sum in str(caught.value)


SCRIPT = """
import threading, rospy
from std_srvs.srv import Empty
rospy.init_node("node")
gate = threading.Event()
rospy.Service("hang", Empty, lambda _: (gate.wait(60), [])[1])
rospy.wait_for_service("hang", timeout=30)
for call in (
    lambda: rospy.ServiceProxy("hang", Empty, timeout=0.5)(),
    lambda: rospy.ServiceProxy("hang", Empty).call(timeout=0.5),
):
    try:
        call()
    except rospy.ServiceException as error:
        print(error, flush=True)
gate.set()
"""


def test_rospy_has_time_limits_for_a_proxy_and_for_a_call(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    (tmp_path / "node.py").write_text(SCRIPT)
    ended = processes.run(sys.executable, tmp_path / "node.py", environment={"ROS_MASTER_URI": master.uri})
    assert ended.stdout == ["service [/hang] did not answer in time"] * 2, ended.output
