"""Why no data arrives on a topic: for each step of a message, a running system in which it fails."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.net.master_client import MasterClient
from pipros_tools.cli import doctor
from pipros_tools.health.gather_topic import gather_topic
from pipros_tools.health.topic_check import STEPS, check_topic
from pipros_tools.health.topic_facts import TopicCheck
from tests.support.nodes import MakeNode, wait_until_connected
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
Int32: Any = load_message_class("std_msgs/Int32")
Joy: Any = load_message_class("sensor_msgs/Joy")
PoseStamped: Any = load_message_class("geometry_msgs/PoseStamped")
TFMessage: Any = load_message_class("tf2_msgs/TFMessage")
TransformStamped: Any = load_message_class("geometry_msgs/TransformStamped")
NOBODY = "http://127.0.0.1:1/"


def checked(master: Master, topic: str, wait_s: float = 2.0) -> TopicCheck:
    environment = Environment(master_uri=master.uri)
    return check_topic(gather_topic(topic, environment, wait_s=wait_s, timeout_s=30.0))


def failed_step(check: TopicCheck) -> tuple[str, str]:
    """Return the name of the step that failed, and the rule. All others before it have passed."""
    assert check.finding is not None, check
    assert [each.name for each in check.steps] == [name for name, _ in STEPS][: len(check.steps)]
    return check.steps[-1].name, check.finding.rule


@contextmanager
def repeating(publish: Callable[[], object], period_s: float = 0.02) -> Iterator[None]:
    has_ended = threading.Event()

    def repeat() -> None:
        while not has_ended.wait(period_s):
            publish()

    thread = threading.Thread(target=repeat, daemon=True)
    thread.start()
    yield
    has_ended.set()
    thread.join()


def register(master: Master, node: str, method: str, *params: str) -> None:
    client = MasterClient(master.uri, node)
    client.call(method, *params)
    client.close()


def pose(stamp: Time, frame: str = "map") -> Any:
    message = PoseStamped()
    message.header.stamp, message.header.frame_id = stamp, frame
    return message


def test_all_steps_of_a_healthy_topic_pass(master: Master, make_node: MakeNode) -> None:
    talker = make_node("talker")
    publisher = talker.advertise("/chatter", String)
    wait_until_connected(make_node("listener").subscribe("/chatter", String, lambda _: None))
    with repeating(lambda: publisher.publish(String("hello"))):
        check = checked(master, "/chatter")
    assert check.finding is None, check
    assert (check.type, len(check.steps)) == ("std_msgs/String", len(STEPS))
    assert "1 of 1 exists" in [each.text for each in check.steps]


def test_a_topic_without_a_publisher(master: Master, make_node: MakeNode) -> None:
    make_node("listener").subscribe("/scan", String, lambda _: None)
    assert failed_step(checked(master, "/scan")) == ("publisher", "no-publishers")
    check = checked(master, "/nothing_like_it")
    assert failed_step(check) == ("publisher", "no-publishers")
    assert "does not exist" in check.steps[-1].text


def test_a_name_that_resembles_a_published_one(master: Master, make_node: MakeNode) -> None:
    make_node("camera").advertise("/left/image_raw", String)
    make_node("listener").subscribe("/left/image_rect", String, lambda _: None)
    check = checked(master, "/left/image_rect")
    assert failed_step(check) == ("publisher", "similar-topic")
    assert "/left/image_raw" in check.steps[-1].text


def test_a_subscriber_with_another_type(master: Master, make_node: MakeNode) -> None:
    make_node("talker").advertise("/battery", String)
    make_node("logger").subscribe("/battery", Int32, lambda _: None)
    check = checked(master, "/battery")
    assert failed_step(check) == ("types", "type-mismatch")
    assert "std_msgs/String" in check.steps[-1].text
    assert "std_msgs/Int32" in check.steps[-1].text


def test_a_subscriber_with_another_definition(master: Master, make_node: MakeNode) -> None:
    make_node("talker").advertise("/battery", String)
    other: Any = type("String", (String,), {"_md5sum": "0" * 32})
    make_node("outdated").subscribe("/battery", other, lambda _: None)
    assert failed_step(checked(master, "/battery")) == ("types", "md5-mismatch")


def test_a_subscriber_that_has_not_connected(master: Master, make_node: MakeNode) -> None:
    make_node("talker").advertise("/chatter", String)
    deaf = make_node("deaf")  # registered by hand, so it is not told of publishers
    register(master, "/other", "registerSubscriber", "/chatter", "std_msgs/String", deaf.uri)
    environment = Environment(master_uri=master.uri)
    facts = gather_topic("/chatter", environment, wait_s=0.1, timeout_s=2.0)
    assert failed_step(check_topic(facts)) == ("connections", "subscriber-cannot-reach")


def test_a_publisher_that_has_ended(master: Master, make_node: MakeNode) -> None:
    register(master, "/ghost", "registerPublisher", "/scan", "sensor_msgs/LaserScan", NOBODY)
    assert failed_step(checked(master, "/scan", 0.1)) == ("addresses", "ghost-node")


def test_a_publisher_that_waits_for_its_own_input(master: Master, make_node: MakeNode) -> None:
    detector = make_node("detector")
    detector.advertise("/detections", String)
    detector.subscribe("/image", String, lambda _: None)
    check = checked(master, "/detections", 0.2)
    assert failed_step(check) == ("messages", "no-message")
    assert check.finding is not None
    assert "no node publishes [/image]" in check.finding.cure


def test_a_publisher_that_has_stopped(master: Master, make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    sent: list[int] = []

    def publish() -> None:
        if publisher.connection_count and len(sent) < 20:
            sent.append(0)
            publisher.publish(String("hello"))

    with repeating(publish, 0.01):
        check = checked(master, "/chatter", 6.0)
    assert failed_step(check) == ("rate", "stopped")


def test_stamps_of_another_clock(master: Master, make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("/pose", PoseStamped)
    with repeating(lambda: publisher.publish(pose(Time(1_000_000_000)))):
        check = checked(master, "/pose")
    assert failed_step(check) == ("stamp", "stamps-differ")


def test_a_frame_without_a_transform(master: Master, make_node: MakeNode) -> None:
    node = make_node("talker")
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "map", "base_link"
    node.advertise("/tf_static", TFMessage, latch=True).publish(TFMessage([transform]))
    assert "1 message in 2.0 s" in [each.text for each in checked(master, "/tf_static").steps]
    publisher = node.advertise("/pose", PoseStamped, latch=True)
    publisher.publish(pose(Time(1), "base_lnk"))
    check = checked(master, "/pose")
    assert failed_step(check) == ("frame", "unknown-frame")
    assert check.finding is not None
    assert "[base_link]" in check.finding.cure
    publisher.publish(pose(Time(1), "/base_link"))
    assert checked(master, "/pose").finding is None


def test_a_subscriber_that_drops_messages(master: Master, make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    has_ended = threading.Event()
    slow = make_node("slow")
    slow.subscribe("/chatter", String, lambda _: has_ended.wait(0.05), queue_size=1)

    def has_dropped() -> bool:
        found = slow.endpoints.subscription("/chatter")
        return found is not None and any(link.link.statistics.dropped for link in found.links)

    with repeating(lambda: publisher.publish(String("hello")), 0.005):
        wait_until(has_dropped)
        check = checked(master, "/chatter")
        has_ended.set()
    assert failed_step(check) == ("queues", "dropped")
    assert "[/slow]" in check.steps[-1].text


def test_the_command_prints_the_steps_and_the_remedy(
    master: Master, make_node: MakeNode, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    make_node("detector").advertise("/detections", String)
    assert doctor.main(["/detections", "--wait", "0.1"]) == 1
    printed = capsys.readouterr().out
    assert printed.startswith("/detections (std_msgs/String)\n  publisher    [/detector] publishes it\n")
    assert "What to do:" in printed
    assert printed.endswith("[no-message]\n\n")

    assert doctor.main(["/detections", "--wait", "0.1", "--json"]) == 1
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["topic"], found["finding"]["rule"]) == ("/detections", "no-message")

    node = make_node("latching")
    node.advertise("/hello", String, latch=True).publish(String("hello"))
    assert doctor.main(["/hello", "--wait", "0.5"]) == 0
    assert capsys.readouterr().out.endswith("\n\nNothing is wrong.\n")


@pytest.mark.parametrize("words", [["/chatter", "--wait", "0"], ["/chatter", "--wait", "nan"]])
def test_a_wait_must_be_a_positive_time(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        doctor.main(words)
    assert ended.value.code == 2
    assert "--wait" in capsys.readouterr().err


def test_topics_and_programs_are_not_mixed(capsys: pytest.CaptureFixture[str]) -> None:
    assert doctor.main(["/chatter", "no such/file.py"]) == 1
    assert "/chatter is a topic" in capsys.readouterr().err
