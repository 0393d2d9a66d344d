"""What users of ros1_bridge have reported."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.node.codec import encoder
from pipros_libraries.topic_tools.raw import class_like
from pipros_ros2.interface import Durability, EndpointKind, Sample, TopicQos
from pipros_ros2.type_pairs import TypePairs
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES
from pipros_rosbag2.distribution import Distribution
from tests.support.ros2_domains import free_domain
from tests.support.ros2_gateways import PAIRS, System
from tests.support.waiting import wait_until

Log: Any = load_message_class("rosgraph_msgs/Log")
LOG = "rcl_interfaces/msg/Log"
GRIPPER = "robot_msgs/msg/Gripper"
FIELDS = "float32 width\nstring state\n"


@pytest.mark.parametrize("is_allowed", [True, False])
def test_rosout_of_ros2_arrives_latched_if_it_is_allowed(*, is_allowed: bool) -> None:
    """ros1_bridge#278: earlier entries did not arrive."""
    rules = "topics: {to_ros1: {allow: [/rosout, '*']}}" if is_allowed else ""
    with free_domain() as domain:
        system = System(domain, has_zenoh=False)
        entry = Log(name="driver", msg="too hot", level=Log.WARN)
        cdr = PAIRS.of_ros2(LOG).plan.to_cdr(b"".join(encoder(Log)(entry)))
        latched = TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1000)
        system.advertise("/rosout", LOG, PAIRS.of_ros2(LOG).type_hash, latched).publish(cdr)
        gateway = system.gateway(rules)
        if is_allowed:
            received: list[Any] = []
            system.ros1.subscribe("/rosout", Log, received.append)
            wait_until(lambda: any(each.name == "driver" for each in received), what="the entry")
            found = next(each for each in received if each.name == "driver")
            assert (found.msg, found.level) == ("too hot", Log.WARN)
        else:
            wait_until(lambda: "topics: to_ros1: /rosout" in gateway.status().left_out, what="the reason")
        system.close()


def test_types_that_no_package_in_ros1_defines_need_no_compilation(tmp_path: Path) -> None:
    """ros1_bridge#28, #77, #271, #348, #394, #431: "No template specialization for the pair"."""
    (tmp_path / "robot_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "robot_msgs" / "package.xml").write_text("<package><name>robot_msgs</name></package>")
    (tmp_path / "robot_msgs" / "msg" / "Gripper.msg").write_text(FIELDS)
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES, [tmp_path])
    md5sum = hashlib.md5(FIELDS.strip().encode()).hexdigest()  # noqa: S324 # ROS 1 requires it
    header = {"type": "robot_msgs/Gripper", "md5sum": md5sum, "message_definition": FIELDS}
    with free_domain() as domain:
        system = System(domain, has_zenoh=False)
        system.gateway(pairs=pairs)
        publisher = system.ros1.advertise("/gripper", class_like(header))
        wait_until(lambda: system.has(EndpointKind.PUBLISHER, "/gripper"), what="the topic in ROS 2")
        (endpoint,) = [each for each in system.ros2.endpoints() if each.name == "/gripper"]
        samples: list[Sample] = []
        system.ros2.subscribe("/gripper", GRIPPER, endpoint.type_hash, TopicQos(), samples.append)

        def publish() -> list[Sample]:
            publisher.publish(publisher.publication.message_class(b"\0\0\x80?\4\0\0\0open"))
            return samples

        wait_until(publish, what="a message")
        expected = b"\0\1\0\0" + b"\0\0\x80?" + b"\5\0\0\0open\0"
        assert bytes(samples[0].payload[: len(expected)]) == expected  # padding may follow
        system.close()
