"""What a gateway drops and leaves out, and the reasons in its status."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros_ros2.bridged_topics import Route
from pipros_ros2.interface import Durability, PartHashes, Ros2CallFailed, TopicQos
from pipros_ros2.rtps import qos as dds
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.qos import Qos
from pipros_ros2.topic_to_ros2 import TopicToRos2
from tests.support.ros2_domains import free_domain
from tests.support.ros2_gateways import PAIRS, System
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
SetBool: Any = load_service_class("std_srvs/SetBool")
STRING, SET_BOOL = "std_msgs/msg/String", "std_srvs/srv/SetBool"
PAIR = PAIRS.of_ros2(STRING)
WRONG = "RIHS01_" + "0" * 64


@pytest.fixture
def system() -> Iterator[System]:
    with free_domain() as domain:
        system = System(domain, has_zenoh=False)
        yield system
        system.close()


def test_subscribers_with_an_incompatible_qos_are_reported(system: System) -> None:
    gateway = system.gateway()
    system.ros1.advertise("/chatter", String)
    latched = TopicQos(durability=Durability.TRANSIENT_LOCAL)
    subscription = system.ros2.subscribe("/chatter", STRING, PAIR.type_hash, latched, print)

    wait_until(lambda: gateway.status().left_out, what="the reason")

    ((what, left_out),) = gateway.status().left_out.items()
    assert what.startswith("topics: to_ros2: /chatter (subscriber ")
    assert left_out.reason.startswith("its QoS is incompatible (durability); set `qos` in a static rule")
    assert not left_out.by_rule
    subscription.close()
    wait_until(lambda: not gateway.status().left_out, what="the end of the subscriber")


def test_services_with_another_definition_are_left_out(system: System) -> None:
    gateway = system.gateway()
    system.ros2.serve("/switch", SET_BOOL, WRONG, bytes, PartHashes(WRONG, WRONG))

    wait_until(lambda: gateway.status().left_out, what="the reason")

    reason = gateway.status().left_out["services: to_ros2: /switch"].reason
    assert reason.startswith("the peer's definition of std_srvs/srv/SetBool differs")


def test_services_with_the_name_of_an_action_do_not_stop_the_gateway(system: System) -> None:
    gateway = system.gateway()
    system.ros2.serve("/odd/_action/send_goal", SET_BOOL, "", bytes)
    system.advertise("/chatter", STRING, PAIR.type_hash, TopicQos())

    wait_until(lambda: system.is_published("/chatter"), what="the topic")
    wait_until(lambda: gateway.status().left_out, what="the reason")

    reason = gateway.status().left_out["actions: to_ros2: /odd"].reason
    assert reason == "std_srvs/srv/SetBool is not the type of an action's send_goal service"


def test_names_that_are_illegal_in_ros2_do_not_stop_the_gateway(system: System) -> None:
    gateway = system.gateway()
    kind = "std_msgs::msg::dds_::String_"
    with Participant(Discovery(system.domain)) as stranger:
        stranger.add_writer("rt/a/1b", kind, Qos(durability=dds.DurabilityKind.TRANSIENT_LOCAL))
        system.advertise("/chatter", STRING, PAIR.type_hash, TopicQos(durability=Durability.TRANSIENT_LOCAL))

        wait_until(lambda: any(row.active for row in gateway.status().passed), what="the other topic")
        wait_until(lambda: gateway.status().left_out, what="the reason")

        assert "is not a full ROS 2 name" in gateway.status().left_out["topics: to_ros1: /a/1b"].reason


def test_a_publisher_of_an_unknown_type_does_not_hide_the_others(system: System) -> None:
    gateway = system.gateway()
    system.advertise("/chatter", "a_msgs/msg/Unknown", "", TopicQos())
    system.advertise("/chatter", STRING, PAIR.type_hash, TopicQos())

    wait_until(lambda: gateway.status().passed, what="the topic")

    assert gateway.status().passed[0].types == ("std_msgs/String", STRING)


def test_failed_calls_are_counted_with_the_reason(system: System) -> None:
    def fail(_: Any) -> Any:
        raise RuntimeError("no power")

    system.ros1.serve("/switch", SetBool, fail)
    gateway = system.gateway("services: {to_ros1: {allow: [/switch]}}")
    caller = system.ros2.caller("/switch", SET_BOOL, "")
    wait_until(lambda: caller.is_available, what="the service")

    with pytest.raises(Ros2CallFailed):
        caller.call(b"\0\1\0\0\1\0\0\0", 0.5)

    wait_until(lambda: gateway.status().passed[0].dropped == 1, what="the count")
    (row,) = gateway.status().passed
    assert (row.name, row.count) == ("/switch", 0)
    assert "no power" in row.reason


class SlowEngine:
    """An engine whose publisher takes 10 ms for each message until the test ends, and has lost two."""

    subscriber_count = 1
    dropped = 2

    def __init__(self) -> None:
        self.is_over = threading.Event()

    def advertise(self, *_: object) -> SlowEngine:
        return self

    def publish(self, _: bytes) -> None:
        self.is_over.wait(0.01)

    def close(self) -> None:
        self.is_over.set()


def test_messages_that_queues_drop_are_counted(system: System) -> None:
    engine: Any = SlowEngine()
    topic = TopicToRos2(system.node("gateway"), engine, Route("/chatter", "/chatter", PAIR), is_latched=False)
    publisher = system.ros1.advertise("/chatter", String)
    topic.update(["/ros1"])
    assert (topic.counts.dropped, topic.counts.reason) == (2, "/chatter: a ROS 2 subscriber is too slow")

    def publish() -> bool:
        for number in range(200):
            publisher.publish(String(str(number)))
        topic.update(["/ros1"])
        return topic.counts.dropped > 2

    wait_until(publish, what="a dropped message")
    assert topic.counts.reason == "/chatter: the gateway is too slow"
    topic.close()
