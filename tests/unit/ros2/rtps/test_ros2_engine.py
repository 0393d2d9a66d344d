"""Two engines for DDS on one machine."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import pytest

from pipros.ros2.engine import (
    CallFailed,
    Durability,
    Endpoint,
    EndpointKind,
    EngineError,
    Problem,
    Reliability,
    Ros2Engine,
    Sample,
    TopicQos,
)
from pipros.ros2.rtps.domain import Discovery
from pipros.ros2.rtps.graph_info import GidBytes
from pipros.ros2.rtps.participant import Participant
from pipros.ros2.rtps.qos import Qos
from pipros.ros2.rtps.ros2_engine import RtpsEngine
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
    publisher = other.announce("/map", KIND, HASH, TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1))
    publisher.publish(CDR + b"old!")

    wait_until(lambda: samples, what="the message")
    wait_until(lambda: publisher.subscriber_count == 1, what="the subscriber")

    endpoint = wait_for_endpoint(one, EndpointKind.PUBLISHER, "/map")
    assert samples == [Sample(CDR + b"old!", endpoint.key)]
    assert (endpoint.type, endpoint.type_hash, endpoint.node, endpoint.gateway) == (
        KIND,
        HASH,
        "/ros1_gateway_ab_12",
        "ab_12",
    )
    assert endpoint.qos == TopicQos(Reliability.RELIABLE, Durability.TRANSIENT_LOCAL)
    subscriber = wait_for_endpoint(other, EndpointKind.SUBSCRIBER, "/map")
    assert (subscriber.node, subscriber.gateway) == ("/robot/camera", "")
    assert (publisher.dropped, subscription.dropped) == (0, 0)
    publisher.close()
    wait_until(lambda: not one.endpoints(), what="the end of the publisher")


def test_services_pass(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    one, other = engines
    caller = one.caller("/add", ADD_KIND, "")
    with pytest.raises(CallFailed, match=r"\[/add\] has no server"):
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

    with pytest.raises(CallFailed, match="did not reply within"):
        caller.call(CDR, 0.2)


def test_endpoints_that_cannot_be_connected_are_problems(engines: tuple[Ros2Engine, Ros2Engine]) -> None:
    one, other = engines
    one.subscribe("/map", KIND, HASH, TopicQos(durability=Durability.TRANSIENT_LOCAL), print)
    one.announce("/scan", "sensor_msgs/msg/LaserScan", "", TopicQos())
    other.announce("/map", KIND, HASH, TopicQos())
    other.subscribe("/scan", KIND, HASH, TopicQos(), print)

    expected = {
        Problem(EndpointKind.SUBSCRIBER, "/map", "its QoS is incompatible (durability)", "/robot/camera"),
        Problem(EndpointKind.PUBLISHER, "/scan", "its type is sensor_msgs/msg/LaserScan", "/robot/camera"),
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
        engines[0].announce("/a", KIND, "", TopicQos())
