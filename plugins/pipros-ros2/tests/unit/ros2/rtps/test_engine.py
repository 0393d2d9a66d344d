"""Two engines for DDS on one machine."""

import contextlib
import socket
from collections.abc import Iterator
from queue import SimpleQueue

import pytest

from pipros.basics.limits import Limits
from pipros_ros2.interface import (
    Durability,
    Endpoint,
    EndpointKind,
    EngineError,
    EngineProblem,
    Reliability,
    Ros2CallFailed,
    Ros2Engine,
    Sample,
    TopicQos,
)
from pipros_ros2.rtps.announcements import ParticipantData, write_participant
from pipros_ros2.rtps.domain import Discovery, discovery_port
from pipros_ros2.rtps.encoding import data_head, datagram_head
from pipros_ros2.rtps.engine import RtpsEngine
from pipros_ros2.rtps.graph_info import GidBytes
from pipros_ros2.rtps.identity import PARTICIPANT_READER, PARTICIPANT_WRITER
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.qos import Qos, QosPolicy
from tests.support.constants import Constants
from tests.support.ros2_domains import free_domain
from tests.support.waiting import wait_until

KIND = "std_msgs/msg/String"
ADD_KIND = "example_interfaces/srv/AddTwoInts"
HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
CDR = b"\0\1\0\0"


@pytest.fixture
def engines() -> Iterator[tuple[Ros2Engine, Ros2Engine]]:
    with free_domain() as domain, contextlib.ExitStack() as stack:
        found = []
        for node, gateway in (("/robot/camera", ""), ("/ros1_gateway_ab_12", "ab_12")):
            engine = RtpsEngine(Discovery(domain), node, gateway=gateway, gid_bytes=GidBytes.IRON_AND_LATER)
            stack.callback(engine.close)
            found.append(engine)
        yield found[0], found[1]


def wait_for_endpoint(engine: Ros2Engine, kind: EndpointKind, name: str) -> Endpoint:
    def found() -> list[Endpoint]:
        return [each for each in engine.endpoints() if (each.kind, each.name) == (kind, name) and each.node]

    wait_until(found, what=f"{kind} of {name}")
    return found()[0]


def test_messages_pass_with_hash_qos_node_and_gateway(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    one, other = engines
    samples: list[Sample] = []
    qos = TopicQos(durability=Durability.TRANSIENT_LOCAL)
    subscription = one.subscribe("/map", KIND, HASH, qos, samples.append)
    publisher = other.advertise("/map", KIND, HASH, TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1))
    publisher.publish(CDR + b"old!")

    wait_until(lambda: samples, what="the message")
    wait_until(lambda: publisher.subscriber_count == 1, what="the subscriber")

    endpoint = wait_for_endpoint(one, EndpointKind.PUBLISHER, "/map")
    assert samples == [Sample(CDR + b"old!", endpoint.key)]
    assert (endpoint.type, endpoint.type_hash, endpoint.node, endpoint.gateway) == (
        KIND, HASH, "/ros1_gateway_ab_12", "ab_12",
    )  # fmt: skip
    assert endpoint.qos == TopicQos(Reliability.RELIABLE, Durability.TRANSIENT_LOCAL)
    subscriber = wait_for_endpoint(other, EndpointKind.SUBSCRIBER, "/map")
    assert (subscriber.node, subscriber.gateway) == ("/robot/camera", "")
    assert (publisher.dropped, subscription.dropped) == (0, 0)
    publisher.close()
    wait_until(lambda: not one.endpoints(), what="the end of the publisher")


def test_services_pass(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    one, other = engines
    caller = one.caller("/add", ADD_KIND, "")
    with pytest.raises(Ros2CallFailed, match=r"\[/add\] has no server"):
        caller.call(CDR, 1.0)
    server = other.serve("/add", ADD_KIND, "", lambda request: request + b"sum!")
    wait_until(lambda: caller.is_available, what="the service")

    assert caller.call(CDR + b"args", 60.0) == CDR + b"argssum!"

    assert wait_for_endpoint(one, EndpointKind.SERVER, "/add").type == ADD_KIND
    assert wait_for_endpoint(other, EndpointKind.CLIENT, "/add").node == "/robot/camera"
    server.close()
    wait_until(lambda: not caller.is_available, what="the end of the service")


def test_a_service_that_raises_gives_no_reply(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    one, other = engines

    def fail(request: bytes) -> bytes:
        raise ValueError(request)

    other.serve("/add", ADD_KIND, "", fail)
    caller = one.caller("/add", ADD_KIND, "")
    wait_until(lambda: caller.is_available, what="the service")

    with pytest.raises(Ros2CallFailed, match="did not reply within"):
        caller.call(CDR, 0.2)


def test_endpoints_that_cannot_be_connected_are_problems(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    one, other = engines
    one.subscribe("/map", KIND, HASH, TopicQos(durability=Durability.TRANSIENT_LOCAL), print)
    one.advertise("/scan", "sensor_msgs/msg/LaserScan", "", TopicQos())
    other.advertise("/map", KIND, HASH, TopicQos())
    other.subscribe("/scan", KIND, HASH, TopicQos(), print)

    expected = {
        EngineProblem(EndpointKind.SUBSCRIBER, "/map", QosPolicy.DURABILITY.reason, "/robot/camera"),
        EngineProblem(
            EndpointKind.PUBLISHER, "/scan", "its type is sensor_msgs/msg/LaserScan", "/robot/camera"
        ),
    }
    wait_until(lambda: {*other.problems()} == expected, what=lambda: str(other.problems()))


def test_servers_whose_requests_have_an_unknown_form_are_problems() -> None:
    with (
        free_domain() as domain,
        Participant(Discovery(domain)) as stranger,
        contextlib.closing(RtpsEngine(Discovery(domain), "/a", gid_bytes=GidBytes.IRON_AND_LATER)) as engine,
    ):
        kind = "example_interfaces::srv::dds_::AddTwoInts"
        stranger.add_reader("rq/addRequest", f"{kind}_Request_", Qos(), print)
        stranger.add_writer("rr/addReply", f"{kind}_Response_", Qos())

        wait_until(lambda: [*engine.endpoints()], what="the server")

        (server,) = engine.endpoints()
        assert (server.kind, server.type) == (EndpointKind.SERVER, ADD_KIND)
        assert server.problem == "the form of service requests is unknown for its DDS implementation"


def test_domains_with_gids_of_two_sizes_are_a_problem() -> None:
    with free_domain() as domain, contextlib.ExitStack() as stack:
        engines = [RtpsEngine(Discovery(domain), "/a", gid_bytes=size) for size in GidBytes]
        for each in engines:
            stack.callback(each.close)

        # The first one to notice stops publishing its nodes, perhaps before the other one has them.
        found = wait_until(lambda: [*engines[0].problems(), *engines[1].problems()], what="the problem")

        assert {each.name for each in found} == {"/a"}
        assert found[0].reason.startswith("`ros2 node list` does not show it")


def test_a_closed_engine_refuses_endpoints(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    engines[0].close()
    with pytest.raises(EngineError, match="closed"):
        engines[0].advertise("/a", KIND, "", TopicQos())


def test_endpoints_may_be_closed_again_and_after_their_engine(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    one, other = engines
    wait_until(lambda: one.has_peers, what="the other engine")
    first, second = (other.advertise(name, KIND, "", TopicQos()) for name in ("/a", "/b"))
    wait_for_endpoint(one, EndpointKind.PUBLISHER, "/b")
    for _ in range(2):
        first.close()

    wait_until(lambda: [each.name for each in one.endpoints()] == ["/b"], what="the end of /a")
    other.close()
    second.close()
    wait_until(lambda: not one.has_peers, what="the end of the other engine")


@pytest.fixture
def engine_and_stranger(constants: Constants) -> Iterator[tuple[RtpsEngine, Participant]]:
    """An engine, and a participant that is not an engine for ROS 2."""
    constants(ROS2_PEER_BYTES=20000, ROS2_HISTORY_BYTES=10000)
    limits = Limits()
    with free_domain() as domain, contextlib.ExitStack() as stack:
        engine = RtpsEngine(Discovery(domain), "/a", gid_bytes=GidBytes.IRON_AND_LATER, limits=limits)
        stack.callback(engine.close)
        yield engine, stack.enter_context(Participant(Discovery(domain)))


def test_endpoints_with_other_types_than_those_of_ros_2_are_left_out(
    engine_and_stranger: tuple[RtpsEngine, Participant],
) -> None:
    engine, stranger = engine_and_stranger
    stranger.add_writer("rt/shapes", "ShapeType", Qos())
    stranger.add_writer("rt/chatter", "std_msgs::msg::dds_::String_", Qos())

    wait_until(engine.endpoints, what="the publisher")
    assert [(each.name, each.type) for each in engine.endpoints()] == [("/chatter", KIND)]


def test_mismatches_are_logged_once_and_only_topics_are_problems(
    engine_and_stranger: tuple[RtpsEngine, Participant], caplog: pytest.LogCaptureFixture
) -> None:
    engine, stranger = engine_and_stranger
    engine.serve("/add", ADD_KIND, "", bytes)
    engine.subscribe("/chatter", KIND, "", TopicQos(), print)
    stranger.add_writer("rq/addRequest", "std_srvs::srv::dds_::Empty_Request_", Qos())
    stranger.add_writer("rt/chatter", "ShapeType", Qos())

    wait_until(engine.problems, what="the problem")
    assert [(each.name, each.reason) for each in engine.problems()] == [("/chatter", "its type is ShapeType")]
    wait_until(lambda: engine.endpoints() and len(caplog.messages) == 2, what=lambda: str(caplog.messages))
    stranger.add_writer("rt/chatter", "std_msgs::msg::dds_::Int32_", Qos())
    wait_until(lambda: engine.endpoints() and len(caplog.messages) == 3, what=lambda: str(caplog.messages))
    assert sorted(caplog.messages) == [
        "/chatter: a peer does not match: its type is ShapeType",
        "/chatter: a peer does not match: its type is std_msgs/msg/Int32",
        "rq/addRequest: a peer does not match: its type is std_srvs/srv/Empty_Request",
    ]


def test_participants_that_announce_too_much_are_logged(
    engine_and_stranger: tuple[RtpsEngine, Participant], caplog: pytest.LogCaptureFixture
) -> None:
    for number in range(50):
        engine_and_stranger[1].add_writer(f"rt/{number}", "ShapeType", Qos())

    expected = ["a ROS 2 participant has announced too many endpoints; further endpoints are ignored"]
    wait_until(lambda: caplog.messages == expected, what=lambda: str(caplog.messages))


def test_participants_with_addresses_of_other_networks_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    elsewhere = ParticipantData(b"a stranger..", discovery=(Address("203.0.113.9", 9),), lease_s=100.0)
    payload = write_participant(elsewhere)
    head = data_head(PARTICIPANT_READER, PARTICIPANT_WRITER, 1, len(payload))
    with (
        free_domain() as domain,
        contextlib.closing(RtpsEngine(Discovery(domain), "/a")) as engine,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sending,
    ):
        for _ in range(2):
            sending.sendto(
                datagram_head(elsewhere.prefix) + head + payload, ("127.0.0.1", discovery_port(domain, 0))
            )

        wait_until(lambda: caplog.messages, what="the warning")
        assert not engine.has_peers
    (warning,) = caplog.messages
    assert warning == (
        "a ROS 2 participant at 127.0.0.1 is ignored, because its addresses are in other networks; "
        "add them to ROS_STATIC_PEERS to allow them"
    )


def test_publishing_fails_while_a_subscriber_does_not_keep_up(
    engine_and_stranger: tuple[RtpsEngine, Participant],
) -> None:
    engine, stranger = engine_and_stranger
    going_on: SimpleQueue[None] = SimpleQueue()
    # A direct callback runs in the thread that confirms samples.
    stranger.add_reader(
        "rt/a", "std_msgs::msg::dds_::String_", Qos(depth=0), lambda _: going_on.get(timeout=60),
        is_direct=True,
    )  # fmt: skip
    publisher = engine.advertise("/a", KIND, "", TopicQos(depth=0))
    wait_until(lambda: publisher.subscriber_count == 1, what="the subscriber")

    def publish_more_than_fits() -> None:
        for _ in range(10):
            publisher.publish(CDR + bytes(5996))

    try:
        with pytest.raises(EngineError, match="readers did not make room for 6000 bytes"):
            publish_more_than_fits()
    finally:
        for _ in range(10):
            going_on.put(None)
