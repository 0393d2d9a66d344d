"""A client of rosbridge and a node of genuine roscpp: topics and services in both directions."""

import cbor2
import pytest

from pipros.basics.env import Environment
from pipros.node import Node
from tests.support.environments import file_of_tests
from tests.support.ros import RosSystem
from tests.support.rosbridge import RosbridgeClient, rosbridge_server
from tests.support.roscpp import compile_program
from tests.support.waiting import wait_until

SOURCE = file_of_tests("interop/programs/web_robot.cpp")


@pytest.mark.timeout(300)
def test_a_client_and_a_cpp_node_use_each_others_topics_and_services(ros: RosSystem) -> None:
    ros.serve_master()
    ros.genuine.start(compile_program(SOURCE, "sensor_msgs", "std_srvs"))
    ros.wait_for_publisher("/imu", 60)
    with (
        Node("bridge", environment=Environment(master_uri=ros.master_uri)) as node,
        rosbridge_server(node) as url,
        RosbridgeClient(url) as client,
        RosbridgeClient(url) as binary,
    ):
        client.send("subscribe", topic="/imu", type="sensor_msgs/Imu")
        imu = client.wait_for("publish")["msg"]
        assert (imu["header"]["frame_id"], imu["orientation_covariance"][8]) == ("base", 0.5)
        binary.send("subscribe", topic="/imu", compression="cbor")
        assert binary.receive(cbor2.loads)["msg"]["orientation"]["w"] == 1.0

        wait_until(lambda: "/enable" in dict(node.master.get_system_state()[2]), 60, "the service /enable")
        assert client.call("/enable", {"data": True})["values"] == {"success": True, "message": "from roscpp"}

        client.send("subscribe", topic="/echo")
        client.send("advertise", topic="/cmd", type="std_msgs/String")
        # The node of C++ sends what it receives at once.
        wait_until(
            lambda: (echo := node.endpoints.subscription("/echo")) and echo.links, 60, "a link from it"
        )
        wait_until(lambda: (cmd := node.endpoints.publication("/cmd")) and cmd.links, 60, "a link to it")
        client.send("publish", topic="/cmd", msg={"data": "to C++"})
        assert client.wait_for("publish", topic="/echo")["msg"] == {"data": "to C++"}

        client.send("subscribe", topic="/answers")
        client.send("advertise_service", service="/from_browser", type="std_srvs/SetBool")
        request = client.wait_for("call_service", service="/from_browser")
        assert request["args"] == {"data": True}
        values = {"success": True, "message": "from a browser"}
        client.send("service_response", service="/from_browser", id=request["id"], values=values, result=True)
        assert client.wait_for("publish", topic="/answers")["msg"] == {"data": "from a browser"}
