"""A gateway between a master and a ROS 2 domain, with an engine as the other side."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros.node.service_link import ServiceFailed
from pipros_ros2.interface import Durability, EndpointKind, Sample, TopicQos
from pipros_ros2.rtps.engine import RtpsEngine
from tests.support.ros2_domains import free_domain
from tests.support.ros2_gateways import PAIRS, System
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
TFMessage: Any = load_message_class("tf2_msgs/TFMessage")
TransformStamped: Any = load_message_class("geometry_msgs/TransformStamped")
SetBool: Any = load_service_class("std_srvs/SetBool")
STRING = "std_msgs/msg/String"
STRING_HASH = PAIRS.of_ros2(STRING).type_hash
TRANSFORMS = "tf2_msgs/msg/TFMessage"
SET_BOOL = "std_srvs/srv/SetBool"
SET_BOOL_HASH = PAIRS.of_ros2_service(SET_BOOL).type_hash
CDR = b"\0\1\0\0"
LATCHED = TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1)


def cdr(text: str) -> bytes:
    encoded = text.encode() + b"\0"
    return CDR + len(encoded).to_bytes(4, "little") + encoded


def texts(samples: list[Sample]) -> list[str]:
    return [bytes(each.payload[8:]).rstrip(b"\0").decode() for each in samples]


@pytest.fixture(params=["rtps", "zenoh"])
def system(request: pytest.FixtureRequest) -> Iterator[System]:
    with free_domain() as domain:
        system = System(domain, has_zenoh=request.param == "zenoh")
        yield system
        system.close()


def wait_while_publishing(publish: Callable[[], object], condition: Callable[[], object], what: str) -> None:
    def is_done() -> bool:
        publish()
        return bool(condition())

    wait_until(is_done, what=what)


def test_topics_reach_ros2_only_while_someone_subscribes(system: System) -> None:
    gateway = system.gateway()
    publisher = system.ros1.advertise("/chatter", String)
    wait_until(lambda: system.has(EndpointKind.PUBLISHER, "/chatter"), what="the topic in ROS 2")
    wait_until(lambda: publisher.connection_count == 0, what="the end of the gateway's query")
    samples: list[Sample] = []

    subscription = system.ros2.subscribe("/chatter", STRING, STRING_HASH, TopicQos(), samples.append)

    wait_while_publishing(lambda: publisher.publish(String("hello")), lambda: samples, "a message")
    assert set(texts(samples)) == {"hello"}
    (row,) = gateway.status().passed
    assert (row.name, row.direction, row.active) == ("/chatter", "to_ros2", True)
    subscription.close()
    wait_until(lambda: publisher.connection_count == 0, what="the end of the subscription in ROS 1")


def test_topics_of_ros2_arrive_only_while_someone_subscribes(system: System) -> None:
    system.gateway()
    publisher = system.advertise("/chatter", STRING, STRING_HASH, TopicQos())
    wait_until(lambda: system.is_published("/chatter"), what="the topic in ROS 1")
    assert publisher.subscriber_count == 0
    received: list[str] = []

    subscriber = system.ros1.subscribe("/chatter", String, lambda message: received.append(message.data))

    wait_while_publishing(lambda: publisher.publish(cdr("hello")), lambda: received, "a message")
    assert set(received) == {"hello"}
    subscriber.unregister()
    wait_until(lambda: publisher.subscriber_count == 0, what="the end of the subscription in ROS 2")
    publisher.close()
    wait_until(
        lambda: "/chatter" not in {name for name, _ in system.ros1.master.get_system_state()[0]},
        what="the end of the topic in ROS 1",
    )


def test_late_subscribers_get_latched_messages_of_all_publishers(system: System) -> None:
    system.gateway()
    for node, text in ((system.ros1, "one"), (system.node("second"), "two")):
        node.advertise("/map", String, latch=True).publish(String(text))
    system.advertise("/plan", STRING, STRING_HASH, LATCHED).publish(cdr("plan"))
    wait_until(lambda: system.is_published("/plan"), what="the topic in ROS 1")
    samples: list[Sample] = []
    received: list[str] = []

    qos = TopicQos(durability=Durability.TRANSIENT_LOCAL)
    system.ros2.subscribe("/map", STRING, STRING_HASH, qos, samples.append)
    system.ros1.subscribe("/plan", String, lambda message: received.append(message.data))

    wait_until(lambda: {*texts(samples)} == {"one", "two"}, what="latched ROS 1 messages")
    wait_until(lambda: received, what="the latched ROS 2 message")
    assert set(received) == {"plan"}


def test_late_subscribers_get_no_messages_of_publishers_that_have_ended(system: System) -> None:
    gateway = system.gateway()
    system.advertise("/plan", STRING, STRING_HASH, LATCHED).publish(cdr("other"))
    before = system.engine()
    ending = before.advertise("/plan", STRING, STRING_HASH, LATCHED)
    ending.publish(cdr("old"))
    wait_until(lambda: [row.count for row in gateway.status().passed] == [2], what="both messages")
    ending.close()
    markers = []
    # When the gateway knows the third topic, it has done two whole updates since the end.
    for marker in ("/one", "/two", "/three"):
        markers.append(before.advertise(marker, STRING, STRING_HASH, TopicQos()))
        wait_until(lambda marker=marker: system.is_published(marker), what="a later topic")  # type: ignore[misc]
    system.advertise("/plan", STRING, STRING_HASH, LATCHED).publish(cdr("new"))
    wait_until(lambda: 3 in [row.count for row in gateway.status().passed], what="the last message")
    received: list[str] = []

    system.ros1.subscribe("/plan", String, lambda message: received.append(message.data))

    wait_until(lambda: "other" in received, what="the other latched message")
    assert received == ["new", "other"]


def test_static_transforms_of_several_nodes_are_merged(system: System) -> None:
    gateway = system.gateway()
    for node, frame in ((system.ros1, "laser"), (system.node("second"), "camera")):
        message = TFMessage([TransformStamped(child_frame_id=frame)])
        message.transforms[0].transform.rotation.w = 1.0
        node.advertise("/tf_static", TFMessage, latch=True).publish(message)
    samples: list[Sample] = []

    system.ros2.subscribe(
        "/tf_static", TRANSFORMS, PAIRS.of_ros2(TRANSFORMS).type_hash, LATCHED, samples.append
    )

    def frames() -> set[str]:
        newest = bytes(samples[-1].payload) if samples else b""
        return {frame for frame in ("laser", "camera") if frame.encode() in newest}

    wait_until(lambda: frames() == {"laser", "camera"}, what="both transforms in one message")
    assert gateway.status().passed[0].dropped == 0


def test_two_gateways_of_one_master_pass_each_message_once(system: System) -> None:
    gateways = [system.gateway(), system.gateway(name="ros2_gateway_1")]
    publisher = system.ros1.advertise("/chatter", String)
    ros2_publisher = system.advertise("/other", STRING, STRING_HASH, TopicQos())
    wait_until(
        lambda: any("another gateway" in str(each.status().left_out) for each in gateways),
        what="a gateway that leaves the topic to the other one",
    )
    samples: list[Sample] = []
    system.ros2.subscribe("/chatter", STRING, STRING_HASH, TopicQos(), samples.append)
    count = 0

    def publish() -> None:
        nonlocal count
        publisher.publish(String(str(count)))
        count += 1

    wait_while_publishing(publish, lambda: len(samples) > 5, "messages")
    assert len(set(texts(samples))) == len(samples)
    passed = {row.name for each in gateways for row in each.status().passed if row.direction == "to_ros1"}
    assert passed <= {"/other"}
    ros2_publisher.close()


def test_nothing_enters_from_other_machines_unless_allowed(system: System) -> None:
    gateway = system.gateway("topics: {to_ros1: {allow: [/allowed]}}", is_local=False)
    system.advertise("/other", STRING, STRING_HASH, TopicQos())
    system.advertise("/allowed", STRING, STRING_HASH, TopicQos())

    wait_until(lambda: system.is_published("/allowed"), what="the allowed topic")
    wait_until(lambda: gateway.status().left_out, what="the reason")

    assert not system.is_published("/other")
    assert gateway.status().left_out["topics: to_ros1: /other"].reason.startswith("the allow list")


def test_unfit_types_are_left_out_with_the_reason(system: System) -> None:
    gateway = system.gateway()
    system.advertise("/strange", "no_msgs/msg/Such", "", TopicQos())
    system.advertise("/changed", STRING, "RIHS01_" + "0" * 64, TopicQos())

    wait_until(lambda: len(gateway.status().left_out) == 2, what="the reasons")

    reasons = gateway.status().left_out
    assert "no type in ROS 1 corresponds to no_msgs/msg/Such" in reasons["topics: to_ros1: /strange"].reason
    assert "definition of std_msgs/msg/String differs" in reasons["topics: to_ros1: /changed"].reason


def test_static_rules_rename_topics(system: System) -> None:
    system.gateway("topics: {static: [{ros1: /scan, ros2: /front/scan, direction: to_ros2}]}")
    system.ros1.advertise("/scan", String)

    wait_until(lambda: system.has(EndpointKind.PUBLISHER, "/front/scan"), what="the renamed topic")

    assert not system.has(EndpointKind.PUBLISHER, "/scan")


def test_static_rules_with_types_pass_topics_before_a_node_publishes_them(system: System) -> None:
    system.gateway(
        "topics: {static: [{ros1: /out, direction: to_ros2, ros1_type: std_msgs/String},"
        " {ros1: /in, ros2: /in2, direction: to_ros1, ros2_type: std_msgs/msg/String}]}"
    )
    samples: list[Sample] = []
    received: list[str] = []
    wait_until(lambda: system.has(EndpointKind.PUBLISHER, "/out"), what="the topic in ROS 2")
    wait_until(lambda: system.is_published("/in"), what="the topic in ROS 1")
    system.ros2.subscribe("/out", STRING, STRING_HASH, TopicQos(), samples.append)
    system.ros1.subscribe("/in", String, lambda message: received.append(message.data))

    publisher = system.ros1.advertise("/out", String)
    ros2_publisher = system.advertise("/in2", STRING, STRING_HASH, TopicQos())

    wait_while_publishing(lambda: publisher.publish(String("out")), lambda: samples, "a message in ROS 2")
    wait_while_publishing(lambda: ros2_publisher.publish(cdr("in")), lambda: received, "a message in ROS 1")
    assert ({*texts(samples)}, {*received}) == ({"out"}, {"in"})


def test_bursts_of_reliable_topics_reach_ros1_completely(system: System) -> None:
    system.gateway()
    publisher = system.advertise("/imu", STRING, STRING_HASH, TopicQos(depth=1000))
    received: list[str] = []
    system.ros1.subscribe("/imu", String, lambda message: received.append(message.data))
    wait_while_publishing(lambda: publisher.publish(cdr("first")), lambda: received, "the first message")
    for burst in range(8):
        for number in range(100):
            publisher.publish(cdr(f"{burst} {number}"))
        wait_until(lambda last=f"{burst} 99": received[-1] == last, what="the last message of the burst")

    assert [text for text in received if text != "first"] == [
        f"{a} {b}" for a in range(8) for b in range(100)
    ]


def test_slow_services_answer_within_the_timeout_of_a_rule(system: System, caplog) -> None:
    release = threading.Event()

    def answer(request: Any) -> Any:
        release.wait(60)
        return SetBool._response_class(request.data, "late")

    system.ros1.serve("/plan", SetBool, answer)
    system.ros1.serve("/short", SetBool, answer)
    gateway = system.gateway(
        "services: {to_ros1: {allow: [/plan, /short]}, static: [{name: /short, timeout_s: 0.2}]}"
    )
    plan, short = (system.ros2.caller(name, SET_BOOL, SET_BOOL_HASH) for name in ("/plan", "/short"))
    wait_until(lambda: plan.is_available and short.is_available, what="the services in ROS 2")

    with ThreadPoolExecutor() as executor:
        answers = [executor.submit(each.call, CDR + b"\1\0\0\0", 60.0) for each in (short, plan)]
        wait_until(
            lambda: [row.dropped for row in gateway.status().passed if row.name == "/short"] == [1],
            what="the timeout",
        )
        release.set()
        assert answers[1].result()[4:5] == b"\1"
        short.close()
        answers[0].exception()
    assert len([text for text in caplog.messages if "/short" in text]) == 1


def test_calls_to_slow_services_of_ros2_take_as_long_as_a_rule_allows(system: System) -> None:
    system.gateway("services: {static: [{name: /switch, timeout_s: 0.2}, {name: /ended, timeout_s: 60}]}")
    release, entered = threading.Event(), threading.Event()

    def answer(request: bytes) -> bytes:
        entered.set()
        release.wait(60)
        return request

    servers = [system.ros2.serve(name, SET_BOOL, SET_BOOL_HASH, answer) for name in ("/switch", "/ended")]
    wait_until(
        lambda: {"/switch", "/ended"} <= {name for name, _ in system.ros1.master.get_system_state()[2]},
        what="the services in ROS 1",
    )
    with pytest.raises(ServiceFailed, match=r"0\.2 s"):
        system.ros1.client("/switch", SetBool).call(SetBool._request_class(True), 60.0)
    entered.clear()
    with ThreadPoolExecutor() as executor:
        pending = executor.submit(
            system.ros1.client("/ended", SetBool).call, SetBool._request_class(True), 60.0
        )
        assert entered.wait(60)
        servers[1].close()
        with pytest.raises(
            ServiceFailed, match=r"\[/ended\] ended before it replied|/ended is not available"
        ):
            pending.result()
    release.set()


def test_services_of_ros2_are_offered_in_ros1(system: System) -> None:
    system.gateway()
    system.ros2.serve(
        "/switch", SET_BOOL, SET_BOOL_HASH, lambda request: CDR + request[4:5] + b"\0" * 3 + cdr("on")[4:]
    )
    wait_until(
        lambda: "/switch" in {name for name, _ in system.ros1.master.get_system_state()[2]},
        what="the service in ROS 1",
    )
    client = system.ros1.client("/switch", SetBool)

    reply = client.call(SetBool._request_class(True), 60.0)

    assert (reply.success, reply.message) == (True, "on")


def test_services_of_ros1_are_offered_in_ros2_only_if_allowed(system: System) -> None:
    for name in ("/switch", "/hidden"):
        system.ros1.serve(name, SetBool, lambda request: SetBool._response_class(request.data, "done"))
    gateway = system.gateway("services: {to_ros1: {allow: [/switch]}}")
    caller = system.ros2.caller("/switch", SET_BOOL, SET_BOOL_HASH)
    wait_until(lambda: caller.is_available, what="the service in ROS 2")

    reply = caller.call(CDR + b"\1\0\0\0", 60.0)

    assert reply[4:5] == b"\1"
    if isinstance(system.ros2, RtpsEngine):
        hashes = {each.type_hash for each in system.ros2.endpoints() if each.name == "/switch"}
        assert PAIRS.of_ros2_service(SET_BOOL).parts.request in hashes
    assert b"done" in reply
    assert not system.has(EndpointKind.SERVER, "/hidden")
    wait_until(lambda: "services: to_ros1: /hidden" in gateway.status().left_out, what="the reason")


def test_diagnostics_have_the_rates_of_topics(system: System) -> None:
    system.gateway()
    system.ros1.advertise("/chatter", String)
    arrays: list[Any] = []

    system.ros1.subscribe(
        "/diagnostics", load_message_class("diagnostic_msgs/DiagnosticArray"), arrays.append
    )

    def values() -> dict[str, str]:
        return {each.key: each.value for array in arrays[-1:] for each in array.status[0].values}

    wait_until(
        lambda: values() == {"topics: to_ros2: /chatter": "0.0/s, 0 dropped"}, what="the topic", timeout_s=60
    )
    assert arrays[-1].status[0].name == "/ROS 2/ros2_gateway_0"
