"""The engine for rclpy with genuine rclpy, beside pipros's engine for DDS in the same domain."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

from pipros_ros2.agent.engine import RclpyEngine
from pipros_ros2.interface import (
    Durability,
    EndpointKind,
    EngineError,
    Reliability,
    Ros2CallFailed,
    Sample,
    TopicQos,
)
from pipros_ros2.qos_table import dds_qos
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine import RtpsEngine
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.qos import QosPolicy
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes
from tests.support.ros2_domains import free_domain
from tests.support.ros2_wheels import DISTROS, environment
from tests.support.waiting import wait_until

STRING = "std_msgs/msg/String", "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
OWN = "own_msgs/msg/Word", "RIHS01_" + "ab" * 32
"""A type for which no package is installed."""
DEEP = TopicQos(depth=100)
HELLO = b"\0\1\0\0\6\0\0\0hello\0\0\0"
# Processes that were killed leave files in shared memory.
UDP = {**os.environ, "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}


def python_of(distro: str) -> str:
    return str(environment(distro) / "bin" / "python")


@dataclass
class Domain:
    """A domain with an engine on rclpy, and another participant."""

    domain: int
    rclpy: RclpyEngine
    peer: RtpsEngine
    ends: list[str]


@pytest.fixture(params=DISTROS)
def domain(request: pytest.FixtureRequest) -> Iterator[Domain]:
    with ExitStack() as stack:
        number = stack.enter_context(free_domain())
        ends: list[str] = []
        rclpy = RclpyEngine(
            Discovery(number), "/agent", python_of(request.param), variables=UDP, on_end=ends.append
        )
        stack.callback(rclpy.close)
        peer = RtpsEngine(Discovery(number), "/peer")
        stack.callback(peer.close)
        yield Domain(number, rclpy, peer, ends)


def collector(found: list[bytes]) -> Callable[[Sample], None]:
    return lambda sample: found.append(bytes(sample.payload))


@pytest.mark.parametrize("of", [STRING, OWN], ids=["generated", "no_package"])
def test_messages_pass_in_both_directions_with_the_hash_of_the_type(
    domain: Domain, of: tuple[str, str]
) -> None:
    of_rclpy: list[bytes] = []
    of_peer: list[bytes] = []
    domain.rclpy.subscribe("/to_rclpy", *of, DEEP, collector(of_rclpy))
    domain.peer.subscribe("/to_peer", *of, DEEP, collector(of_peer))
    senders = (
        (domain.peer.advertise("/to_rclpy", *of, DEEP), of_rclpy),
        (domain.rclpy.advertise("/to_peer", *of, DEEP), of_peer),
    )

    for sender, received in senders:
        wait_until(lambda sender=sender: sender.subscriber_count == 1)
        for number in range(100):
            sender.publish(HELLO[:8] + b"%05d\0\0\0" % number)
        wait_until(lambda received=received: len(received) == 100)
        assert received == [HELLO[:8] + b"%05d\0\0\0" % number for number in range(100)]
    for engine, node in ((domain.rclpy, "/peer"), (domain.peer, "/agent")):
        wait_until(
            lambda engine=engine, node=node: (
                [(each.type, each.type_hash) for each in engine.endpoints() if each.name.startswith("/to_")]
                == [of, of]
                and {each.node for each in engine.endpoints()} == {node}
            )
        )


def test_own_messages_do_not_return_and_others_name_their_publisher(domain: Domain) -> None:
    received: list[Sample] = []
    domain.rclpy.subscribe("/words", *STRING, TopicQos(), received.append)
    own = domain.rclpy.advertise("/words", *STRING, TopicQos())
    of_peer: list[bytes] = []
    domain.peer.subscribe("/words", *STRING, TopicQos(), collector(of_peer))
    peer = domain.peer.advertise("/words", *STRING, TopicQos())
    wait_until(lambda: own.subscriber_count == 1 and peer.subscriber_count == 1)

    own.publish(HELLO)
    wait_until(lambda: of_peer == [HELLO])
    peer.publish(HELLO)
    wait_until(lambda: received)

    (publisher,) = (each for each in domain.rclpy.endpoints() if each.kind is EndpointKind.PUBLISHER)
    assert [each.publisher for each in received] == [publisher.key]


def test_gateways_on_rclpy_and_on_dds_know_each_other(domain: Domain) -> None:
    with ExitStack() as stack:
        discovery, python = Discovery(domain.domain), python_of(DISTROS[0])
        one = RclpyEngine(discovery, "/ros1_gateway_one_1", python, variables=UDP)
        stack.callback(one.close)
        two = RtpsEngine(discovery, "/ros1_gateway_two_2", gateway="two_2")
        stack.callback(two.close)
        for engine in (one, two):
            engine.advertise("/words", *STRING, TopicQos())

        def gateways(engine: RclpyEngine | RtpsEngine) -> list[str]:
            return [each.gateway for each in engine.endpoints() if each.name == "/words"]

        wait_until(lambda: (gateways(one), gateways(two)) == (["two_2"], ["one_1"]))


def test_late_subscribers_get_latched_messages_only_from_latching_publishers(domain: Domain) -> None:
    latched = TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1)
    domain.peer.advertise("/map", *STRING, latched).publish(HELLO)
    received: list[bytes] = []
    domain.rclpy.subscribe("/map", *STRING, latched, collector(received))
    domain.rclpy.advertise("/plan", *STRING, latched).publish(HELLO)
    of_peer: list[bytes] = []
    domain.peer.subscribe("/plan", *STRING, latched, collector(of_peer))

    wait_until(lambda: received == of_peer == [HELLO])


def test_names_that_ros2_does_not_allow_do_not_disturb_others(domain: Domain) -> None:
    with Participant(Discovery(domain.domain), b"enclave=/;", lambda _: None) as odd:
        for topic in ("rt/not-allowed", "rt/", "rt//x", "rq/9/é", "rt/\x7f"):
            odd.add_writer(topic, "std_msgs::msg::dds_::String_", dds_qos(TopicQos()))
        odd.add_writer("rt/odd_type", "no ros type", dds_qos(TopicQos()))
        received: list[bytes] = []
        domain.rclpy.subscribe("/words", *STRING, TopicQos(), collector(received))
        publisher = domain.peer.advertise("/words", *STRING, TopicQos())
        wait_until(lambda: publisher.subscriber_count)
        wait_until(lambda: [each.name for each in domain.rclpy.endpoints() if each.name == "/words"])
        publisher.publish(HELLO)

        wait_until(lambda: received == [HELLO] or domain.ends)
        assert domain.ends == []


def test_malformed_requests_and_failing_services_get_no_reply(domain: Domain) -> None:
    requests: list[bytes] = []

    def answer(request: bytes) -> bytes:
        requests.append(request)
        if request[4]:
            raise ValueError("refused")
        return b"\0\1\0\0\1\0\0\0\3\0\0\0ok\0"

    domain.rclpy.serve("/switch", "std_srvs/srv/SetBool", "", answer)
    caller = domain.peer.caller("/switch", "std_srvs/srv/SetBool", "")
    wait_until(lambda: caller.is_available)

    for bad in (b"\0\1\0\0", b"\0\1\0\0\1"):
        with pytest.raises(Ros2CallFailed):
            caller.call(bad, 0.1)
    assert caller.call(b"\0\1\0\0\0", 60)[:15] == b"\0\1\0\0\1\0\0\0\3\0\0\0ok\0"
    assert (len(requests), domain.ends) == (2, [])


def test_a_call_ends_with_its_server(domain: Domain) -> None:
    is_called = threading.Event()

    def answer(request: bytes) -> None:
        is_called.set()

    server = domain.peer.serve("/switch", "std_srvs/srv/SetBool", "", answer)
    caller = domain.rclpy.caller("/switch", "std_srvs/srv/SetBool", "")
    with ThreadPoolExecutor() as executor:
        pending = executor.submit(caller.call, b"\0\1\0\0\1", 60)
        assert is_called.wait(60)
        server.close()
        with pytest.raises(Ros2CallFailed, match="/switch failed: the server ended before it replied"):
            pending.result()


def test_an_incompatible_qos_is_a_problem_with_the_name_of_the_node(domain: Domain) -> None:
    domain.rclpy.subscribe("/scan", *STRING, TopicQos(), print)
    domain.peer.advertise("/scan", *STRING, TopicQos(Reliability.BEST_EFFORT))

    wait_until(lambda: domain.rclpy.problems())
    (problem,) = domain.rclpy.problems()
    wait_until(lambda: domain.rclpy.problems()[0].node == "/peer")
    assert (problem.kind, problem.name) == (EndpointKind.PUBLISHER, "/scan")
    assert problem.reason == QosPolicy.RELIABILITY.reason


def test_absent_packages_of_services_and_other_definitions_are_refused(domain: Domain) -> None:
    with pytest.raises(EngineError, match=r"^/s: the ROS 2 of .* has no type own_msgs/srv/Do$"):
        domain.rclpy.caller("/s", "own_msgs/srv/Do", "")
    with pytest.raises(
        EngineError, match=r"^/t: rclpy has another definition of std_msgs/msg/String; --distro"
    ):
        domain.rclpy.advertise("/t", STRING[0], OWN[1], TopicQos())
    assert domain.rclpy.lacks("test_msgs/action/Fibonacci_SendGoal") == ""
    assert "has no type own_msgs/action/Do_SendGoal" in domain.rclpy.lacks("own_msgs/action/Do_SendGoal")


def test_calls_fail_and_the_engine_says_so_if_rclpy_ends(domain: Domain) -> None:
    caller = domain.rclpy.caller("/absent", "std_srvs/srv/SetBool", "")
    with pytest.raises(Ros2CallFailed, match="/absent is not available"):
        caller.call(b"\0\1\0\0\1", 0.01)

    os.kill(domain.rclpy.pid, signal.SIGKILL)

    reason = "the process of rclpy ended with exit code -9"
    with pytest.raises(Ros2CallFailed, match=reason):
        caller.call(b"\0\1\0\0\1", 60)
    wait_until(lambda: domain.ends == [reason])
    with pytest.raises(EngineError, match=reason):
        domain.rclpy.advertise("/t", *STRING, TopicQos())


@pytest.mark.parametrize("stop", [
    "os.kill(os.getpid(), 9)", "os._exit(0)", "engine.close(); input()",
    "os.kill(engine.pid, 19); engine.close(); input()",  # 19 is SIGSTOP
])  # fmt: skip
def test_rclpy_ends_with_the_gateway(stop: str, processes: Processes, tmp_path: Path) -> None:
    program = (
        "import os, sys; from pipros_ros2.agent.engine import RclpyEngine; "
        "from pipros_ros2.rtps.domain import Discovery; "
        "engine = RclpyEngine(Discovery(int(sys.argv[1])), '/agent', sys.argv[2]); "
        f"print(engine.pid, flush=True); {stop}"
    )
    with free_domain() as number:
        argv = (sys.executable, "-c", program, str(number), python_of(DISTROS[0]))
        gateway = processes.start(*argv, environment={"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}, stdin=-1)
        pid = gateway.wait_for("^([0-9]+)$")[1]

        wait_until(lambda: not Path("/proc", pid, "exe").exists())


def test_wheels_of_pypi_have_no_security(tmp_path: Path) -> None:
    (tmp_path / "enclaves").mkdir()
    for name in ("identity_ca.cert", "cert", "key", "permissions_ca.cert"):
        (tmp_path / "enclaves" / f"{name}.pem").touch()
    for name in ("governance", "permissions"):
        (tmp_path / "enclaves" / f"{name}.p7s").touch()
    secure = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}
    variables = {**UDP, **secure, "ROS_SECURITY_KEYSTORE": str(tmp_path)}

    with (
        free_domain() as number,
        pytest.raises(
            EngineError, match=r"has no DDS Security \(SROS 2\), like the wheels on PyPI: use an inst"
        ),
    ):
        RclpyEngine(Discovery(number), "/agent", python_of("jazzy"), variables=variables)


@pytest.mark.parametrize("distro", DISTROS)
def test_nodes_of_a_discovery_server_are_found(distro: str, processes: Processes) -> None:
    folder, port = environment(distro), ClaimedPort()
    libraries = [folder / "lib", *(folder / "lib").glob("python*/site-packages/ros_*.libs")]
    words = ("-i", "0", "-l", "127.0.0.1", "-p", str(port.number))
    words = words if distro == "jazzy" else ("42", *words)  # the number of the command `server`
    server = processes.start(
        str(folder / "bin" / "fast-discovery-server"),
        *words,
        environment={"LD_LIBRARY_PATH": os.pathsep.join(map(str, libraries))},
    )
    server.wait_for("Server (is running|started)")
    served: Mapping[str, str] = {**UDP, "ROS_DISCOVERY_SERVER": f"127.0.0.1:{port.number}"}
    received: list[bytes] = []
    with free_domain() as number, ExitStack() as stack:
        one, two = (
            RclpyEngine(Discovery(number), f"/{name}", python_of(distro), variables=served)
            for name in ("one", "two")
        )
        dds = RtpsEngine(Discovery(number), "/dds")
        for engine in (one, two, dds):
            stack.callback(engine.close)
        one.subscribe("/words", *STRING, TopicQos(), collector(received))
        publisher = two.advertise("/words", *STRING, TopicQos())
        wait_until(lambda: publisher.subscriber_count)
        publisher.publish(HELLO)

        wait_until(lambda: received == [HELLO])
        assert [each.name for each in one.endpoints() if each.name == "/words"] == ["/words"]
        assert dds.endpoints() == []
    port.release()
