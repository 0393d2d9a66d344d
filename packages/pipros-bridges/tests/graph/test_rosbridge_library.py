"""The facade rosbridge_library, as packages with their own servers and capabilities import it."""

import json
import sys

import pytest

from rosbridge_library.internal import message_conversion, ros_loader
from rosbridge_library.internal.exceptions import InvalidArgumentException, MissingArgumentException
from tests.support.ros import RosSystem

PROGRAM = """
import json, queue
import rospy
from rosbridge_library.capability import Capability
from rosbridge_library.rosbridge_protocol import RosbridgeProtocol

class Greeting(Capability):
    def __init__(self, protocol):
        Capability.__init__(self, protocol)
        protocol.register_operation("greet", self.greet)

    def greet(self, message):
        self.basic_type_check(message, [(True, "name", str)])
        self.protocol.send({"op": "greeting", "text": "hello " + message["name"]})

rospy.init_node("own_server")
sent = queue.Queue()
protocol = RosbridgeProtocol("a client")
protocol.outgoing = lambda message, compression="none": sent.put(message)
protocol.add_capability(Greeting)
protocol.incoming(json.dumps({"op": "greet", "name": "you"}))
print(sent.get(timeout=60))
protocol.incoming(json.dumps({"op": "greet"}))
protocol.incoming(json.dumps({"op": "subscribe", "topic": "/x"}))
protocol.incoming(json.dumps({"op": "advertise", "topic": "/x", "type": "std_msgs/String"}))
protocol.incoming(json.dumps({"op": "publish", "topic": "/x", "msg": {"data": "own"}}))
print(sent.get(timeout=60))
protocol.finish()
"""


def test_a_server_of_its_own_has_all_operations_and_capabilities(ros: RosSystem) -> None:
    ros.serve_master()
    ended = ros.pipros.run(sys.executable, "-c", PROGRAM)
    assert ended.returncode == 0, ended.output
    greeting, published = map(json.loads, ended.stdout[:2])
    assert greeting == {"op": "greeting", "text": "hello you"}
    assert published == {"op": "publish", "topic": "/x", "msg": {"data": "own"}}
    assert "missing required argument name" in ended.output


def test_messages_convert_to_values_and_back() -> None:
    point = ros_loader.get_message_instance("geometry_msgs/Point")
    assert message_conversion.populate_instance({"x": 1}, point) is point
    assert message_conversion.extract_values(point) == {"x": 1.0, "y": 0.0, "z": 0.0}
    with pytest.raises(message_conversion.NonexistentFieldException, match="has no field a"):
        message_conversion.populate_instance({"a": 1}, point)
    with pytest.raises(message_conversion.FieldTypeMismatchException, match="must be float64"):
        message_conversion.populate_instance({"x": "1"}, point)
    with pytest.raises(message_conversion.InvalidMessageException):
        message_conversion.extract_values("no message")


@pytest.mark.parametrize(("name", "error"), [
    ("", ros_loader.InvalidTypeStringException), ("String", ros_loader.InvalidTypeStringException),
    ("std_msgs/srv/String", ros_loader.InvalidTypeStringException),
    ("no_such_package/String", ros_loader.InvalidPackageException),
    ("std_msgs/Nothing", ros_loader.InvalidClassException),
])  # fmt: skip
def test_unknown_types_have_their_exceptions(name: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        ros_loader.get_message_class(name)


def test_classes_are_found_by_their_names() -> None:
    assert ros_loader.get_message_class("std_msgs/msg/String")._type == "std_msgs/String"
    assert ros_loader.get_service_request_instance("std_srvs/SetBool").data is False
    assert ros_loader.get_service_response_instance("std_srvs/SetBool").success is False
    assert ros_loader.get_service_instance("std_srvs/SetBool")._type == "std_srvs/SetBool"


def test_exceptions_of_arguments_can_be_raised() -> None:
    for error in (InvalidArgumentException, MissingArgumentException):
        with pytest.raises(error, match="why"):
            raise error("why")
