"""The engine for rmw_zenoh with peers that are written from the published format."""

import itertools
import struct
import sys
import threading
from collections.abc import Iterator

import pytest

from pipros_ros2.interface import (
    Durability,
    EndpointKind,
    EngineError,
    Ros2CallFailed,
    Ros2Engine,
    Sample,
    TopicQos,
)
from pipros_ros2.zenoh.engine import ZenohEngine
from tests.support.constants import Constants
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes
from tests.support.waiting import wait_until
from tests.support.zenoh_peer import ADD, ADD_TYPE, STRING, Peer, Router, attachment_of, gid_of

KIND = "std_msgs/msg/String"
ADD_KIND = "example_interfaces/srv/AddTwoInts"
LATCHED = TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1)


@pytest.fixture
def router() -> Iterator[Router]:
    router = Router()
    yield router
    router.close()


@pytest.fixture
def engine(router: Router) -> Iterator[Ros2Engine]:
    engine = ZenohEngine(0, "/robot/gateway", [router.address], timeout_s=60)
    yield engine
    engine.close()


@pytest.fixture
def peer(router: Router) -> Iterator[Peer]:
    peer = Peer(router)
    yield peer
    peer.close()


def wait_for_endpoint(engine: Ros2Engine, kind: EndpointKind, name: str) -> None:
    wait_until(
        lambda: any((each.kind, each.name) == (kind, name) for each in engine.endpoints()),
        what=f"{kind} of {name}",
    )


def test_an_engine_is_closed_while_a_service_is_being_offered(router: Router, monkeypatch) -> None:
    engine = ZenohEngine(0, "/robot/gateway", [router.address], timeout_s=60)
    is_starting, may_start = threading.Event(), threading.Event()

    class SlowThread(threading.Thread):
        def start(self) -> None:
            is_starting.set()
            assert may_start.wait(60)
            super().start()

    starting = threading.Thread(target=engine.start, args=("calls", lambda: None))
    monkeypatch.setattr(threading, "Thread", SlowThread)
    starting.start()
    assert is_starting.wait(60)
    engine.close()
    may_start.set()
    starting.join(60)


@pytest.mark.parametrize("size", [10, 1_000_000])
def test_messages_reach_ros2_with_their_attachments(engine: Ros2Engine, peer: Peer, size: int) -> None:
    received = peer.subscribe("/chatter")
    publisher = engine.advertise("/chatter", KIND, STRING, TopicQos())
    wait_until(lambda: publisher.subscriber_count == 1, what="the subscriber")
    published = itertools.count(1)

    def arrived() -> bool:
        publisher.publish((b"%010d" % next(published)).ljust(size, b"x"))
        return len(received) > 2

    wait_until(arrived, what="messages in ROS 2")

    (token,) = wait_until(lambda: [each for each in peer.tokens if "/MP/" in each], what="the token")
    assert "/MP/%/%robot/gateway/%chatter/std_msgs::msg::dds_::String_/" in token
    assert token.endswith("/::,10:,:,:,,")
    payloads, attachments = zip(*received, strict=True)
    assert {len(each) for each in payloads} == {size}
    numbers = [struct.unpack_from("<q", each)[0] for each in attachments]
    # In order; on a busy machine, Zenoh drops some large messages.
    assert numbers == sorted(set(numbers)) == [int(each[:10]) for each in payloads]
    assert {each[16:] for each in attachments} == {b"\x10" + gid_of(token)}


@pytest.mark.parametrize("type_hash", [STRING, ""])
def test_messages_of_ros2_arrive(engine: Ros2Engine, peer: Peer, type_hash: str) -> None:
    samples: list[Sample] = []
    subscriber = engine.subscribe("/chatter", KIND, type_hash, TopicQos(), samples.append)
    publisher = peer.publisher("/chatter", type_hash=type_hash or "TypeHashNotSupported")
    wait_for_endpoint(engine, EndpointKind.PUBLISHER, "/chatter")

    def arrived() -> bool:
        publisher.put(b"dropped", is_attached=False)
        publisher.put(b"hello" * 200_000)
        return len(samples) > 2

    wait_until(arrived, what="ROS 2 messages")

    assert set(samples) == {Sample(b"hello" * 200_000, publisher.gid)}
    (endpoint,) = engine.endpoints()
    assert (endpoint.node, endpoint.type, endpoint.type_hash) == ("/peer", KIND, type_hash)
    assert endpoint.key == publisher.gid
    subscriber.close()
    wait_until(lambda: not any("/MS/" in each for each in peer.tokens), what="the end of the token")


def test_late_subscribers_of_ros2_get_the_latched_message(engine: Ros2Engine, peer: Peer) -> None:
    publisher = engine.advertise("/map", KIND, STRING, LATCHED)
    publisher.publish(b"old")
    publisher.publish(b"new")
    wait_until(lambda: any("/MP/" in each for each in peer.tokens), what="the token")

    received = peer.subscribe("/map", is_latched=True)

    wait_until(lambda: received, what="the latched message")
    assert [payload for payload, _ in received] == [b"new"]


def test_a_late_gateway_gets_latched_messages_of_ros2(engine: Ros2Engine, peer: Peer) -> None:
    peer.publisher("/map", is_latched=True).put(b"map")
    wait_for_endpoint(engine, EndpointKind.PUBLISHER, "/map")
    samples: list[Sample] = []

    engine.subscribe("/map", KIND, STRING, LATCHED, samples.append)

    wait_until(lambda: samples, what="the latched message")
    assert [sample.payload for sample in samples] == [b"map"]


def test_services_of_ros2_are_called(engine: Ros2Engine, peer: Peer) -> None:
    caller = engine.caller("/add", ADD_KIND, ADD)
    with pytest.raises(Ros2CallFailed, match="the ROS 2 service /add is not available"):
        caller.call(b"request", 5.0)
    peer.serve("/add", lambda request: request[::-1])
    wait_until(lambda: caller.is_available, what="the service")

    assert caller.call(b"abc", 60.0) == b"cba"
    caller.close()
    wait_until(lambda: not any("/SC/" in each for each in peer.tokens), what="the end of the client")


def test_services_are_offered_to_ros2(engine: Ros2Engine, peer: Peer) -> None:
    server = engine.serve("/add", ADD_KIND, ADD, lambda request: request.upper())
    wait_until(lambda: any("/SS/" in each for each in peer.tokens), what="the token")

    ((payload, attachment),) = peer.call("/add", b"abc")

    assert payload == b"ABC"
    assert struct.unpack_from("<q", attachment)[0] == 7  # the reply has the number and client of the request
    server.close()
    wait_until(lambda: not any("/SS/" in each for each in peer.tokens), what="the end of the service")
    assert peer.call("/add", b"abc") == []


def test_a_service_that_raises_or_refuses_gives_no_reply(engine: Ros2Engine, peer: Peer, caplog) -> None:
    engine.serve("/add", ADD_KIND, ADD, {b"none": None, b"x": b"x"}.__getitem__)
    wait_until(lambda: any("/SS/" in each for each in peer.tokens), what="the token")

    assert peer.call("/add", b"none") == caplog.messages == []
    assert peer.call("/add", b"") == []
    assert len(caplog.messages) == 1
    assert [payload for payload, _ in peer.call("/add", b"x")] == [b"x"]


def test_requests_of_unknown_clients_leave_room_for_known_ones(engine: Ros2Engine, peer: Peer) -> None:
    may_end = threading.Event()
    engine.serve("/add", ADD_KIND, ADD, lambda request: request if request or may_end.wait(60) else None)
    wait_until(lambda: any("/SS/" in each for each in peer.tokens), what="the token")
    key = peer.key("/add", ADD_TYPE, ADD)
    gids = [number.to_bytes(16, "big") for number in range(100)]
    held = [peer.session.get(key, attachment=attachment_of(1, 1, gid), payload=b"") for gid in gids]
    wait_until(lambda: peer.call("/add", b"x"), what="an answer to a known client")
    may_end.set()
    assert len(held) == 100


def test_endpoints_disappear_with_their_session(engine: Ros2Engine, router: Router) -> None:
    peer = Peer(router)
    peer.publisher("/chatter")
    wait_for_endpoint(engine, EndpointKind.PUBLISHER, "/chatter")

    peer.close()

    wait_until(lambda: not engine.endpoints(), what="the end of the publisher")


def test_a_restarted_peer_is_found_again(engine: Ros2Engine, router: Router) -> None:
    publisher = engine.advertise("/chatter", KIND, STRING, TopicQos())
    for _ in range(2):
        peer = Peer(router)
        received = peer.subscribe("/chatter")

        def arrived(received: list[tuple[bytes, bytes]] = received) -> bool:
            publisher.publish(b"hello")
            return bool(received)

        wait_until(arrived, what="a message")
        peer.close()
        wait_until(lambda: publisher.subscriber_count == 0, what="the end of the subscriber")


def test_remembered_endpoints_are_limited(router: Router, peer: Peer, caplog, constants: Constants) -> None:
    for number in range(20):
        peer.declare("MP", f"/topic{number}", "std_msgs::msg::dds_::String_", STRING)
    constants(ROS2_GRAPH_BYTES=8000)
    engine = ZenohEngine(0, "/gateway", [router.address], timeout_s=60)

    wait_until(lambda: "too many endpoints in ROS 2" in caplog.text, what="the warning")

    kept = [each.name for each in engine.endpoints()]
    assert 1 <= len(kept) <= 3
    other = ZenohEngine(0, "/other", [router.address], timeout_s=60)
    kind, string = EndpointKind.PUBLISHER, "std_msgs/msg/String"
    held = other.advertise("/other", string, STRING, TopicQos())
    wait_until(lambda: engine.count(kind, "/other", string) == 1, what="what another process publishes")
    peer.close()
    wait_until(lambda: not sum(engine.count(kind, each, string) for each in kept), what="their end")
    held.close()
    other.close()
    engine.close()


def test_an_engine_without_a_router_raises() -> None:
    port = ClaimedPort()
    address = f"tcp/127.0.0.1:{port.number}"

    with pytest.raises(EngineError, match=f"no Zenoh router answers at {address}"):
        ZenohEngine(0, "/gateway", [address], timeout_s=0.2)
    port.release()


def test_a_closed_engine_refuses_endpoints(router: Router) -> None:
    engine = ZenohEngine(0, "/gateway", [router.address], timeout_s=60)
    announced = engine.advertise("/chatter", KIND, STRING, TopicQos())
    engine.close()
    engine.close()

    with pytest.raises(EngineError, match=r"cannot publish \[/chatter\]"):
        announced.publish(b"")
    with pytest.raises(EngineError, match="is closed"):
        engine.advertise("/chatter", KIND, STRING, TopicQos())


PROGRAM = """
import sys
from pipros_ros2.interface import TopicQos
from pipros_ros2.zenoh.engine import ZenohEngine
engine = ZenohEngine(0, "/gateway", sys.argv[1:], timeout_s=60)
engine.subscribe("/chatter", "std_msgs/msg/String", "", TopicQos(), print)
"""


def test_a_program_may_end_without_closing(router: Router) -> None:
    processes = Processes({})
    try:
        done = processes.run(sys.executable, "-c", PROGRAM, router.address)
        assert (done.returncode, done.output) == (0, "")
    finally:
        processes.end_all()
