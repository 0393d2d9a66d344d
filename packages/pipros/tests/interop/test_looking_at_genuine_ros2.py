"""`pipros ros2 topics`, `echo` and the other commands that look at ROS 2, beside a genuine node."""

import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Process, Processes
from tests.support.ros2_wheels import DISTROS, environment

pytestmark = needs_network
PROGRAM = Path(__file__).parent / "programs" / "genuine_ros2_shown_node.py"


class Domain:
    """A genuine node, and commands, in a network of their own."""

    def __init__(self, distro: str, folder: Path, network: LoneNetwork) -> None:
        self._distro = distro
        self._network = network
        self._processes = Processes({"PATH": "/usr/bin:/bin", "HOME": str(folder)}, folder)
        private = 'mount -t tmpfs shm /dev/shm && exec "$@"'
        python = str(environment(distro) / "bin" / "python")
        argv = network.command("sh", "-c", private, "sh", python, str(PROGRAM))
        self.node = self._processes.start(*argv)
        self.node.wait_for("^ready$")

    def _command(self, words: tuple[str, ...]) -> list[str]:
        options = ("--distro", self._distro, "--msgs", str(environment(self._distro) / "share"))
        program = Path(sys.executable).parent / "pipros"
        return self._network.command(str(program), "ros2", words[0], *options, *words[1:])

    def run(self, *words: str) -> Process:
        return self._processes.run(*self._command(words))

    def start(self, *words: str) -> Process:
        return self._processes.start(*self._command(words))

    def close(self) -> None:
        self._processes.end_all()


@pytest.fixture(scope="module", params=DISTROS)
def domain(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Domain]:
    network = LoneNetwork("127.0.0.1 localhost\n")
    domain = Domain(request.param, tmp_path_factory.mktemp("shown"), network)
    try:
        yield domain
    finally:
        domain.close()
        network.close()


def test_topics_are_listed_with_types_and_counts(domain: Domain) -> None:
    assert domain.run("topics").output.splitlines() == [
        *("/chatter", "/heard", "/kept", "/parameter_events", "/rosout", "/scan")
    ]
    assert "/scan [sensor_msgs/msg/LaserScan]" in domain.run("topics", "-t").output
    verbose = domain.run("topics", "-v").output
    assert verbose.startswith("Published topics:\n * /chatter [std_msgs/msg/String] 1 publisher\n")
    assert "\n\nSubscribed topics:\n * /heard [std_msgs/msg/String] 1 subscriber\n" in verbose
    assert domain.run("topics", "-c").output == "6"


def test_a_topic_is_described_with_its_endpoints(domain: Domain) -> None:
    assert domain.run("topics", "/chatter").output == (
        "Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 0"
    )
    verbose = domain.run("topics", "-v", "/scan").output
    assert "\nNode name: shown\nNode namespace: /robot\nTopic type: sensor_msgs/msg/LaserScan\n" in verbose
    assert "\n  Reliability: BEST_EFFORT\n  History (Depth): UNKNOWN\n  Durability: VOLATILE\n" in verbose
    assert re.search(r"^Topic type hash: RIHS01_[0-9a-f]{64}$", verbose, re.MULTILINE)
    missing = domain.run("topics", "/nothing")
    assert (missing.returncode, missing.output) == (1, "ERROR: topic [/nothing] was not found")


def test_nodes_services_and_actions_are_listed_and_described(domain: Domain) -> None:
    assert domain.run("nodes").output == "/robot/shown"
    described = domain.run("nodes", "/robot/shown").output
    assert "    /switch: std_srvs/srv/SetBool\n  Service Clients:\n  Action Servers:\n" in described
    assert "/switch [std_srvs/srv/SetBool]" in domain.run("services", "-t").output
    assert domain.run("services", "/switch").output == (
        "Type: std_srvs/srv/SetBool\nClients count: 0\nServices count: 1"
    )
    assert domain.run("actions", "-t").output == "/fibonacci [test_msgs/action/Fibonacci]"
    assert domain.run("actions", "/fibonacci").output == (
        "Action: /fibonacci\nAction clients: 0\nAction servers: 1\n    /robot/shown"
    )


def test_messages_are_printed(domain: Domain) -> None:
    assert domain.run("echo", "--once", "/kept").output == "data: 'kept: é'\n---"
    assert domain.run("echo", "--once", "--field", "data", "/kept").output == "kept: é\n---"
    scan = domain.run("echo", "--once", "/scan").output
    assert scan.startswith(
        "header:\n  stamp:\n    sec: 1\n    nanosec: 2\n  frame_id: laser\nangle_min: 0.0\n"
    )
    assert "ranges:\n" + "- 1.5\n" * 128 + "- '...'\n" in scan
    assert (
        "ranges: '<sequence type: float, length: 200>'\n"
        in domain.run("echo", "--once", "--no-arr", "/scan").output
    )
    assert domain.run("echo", "--once", "-f", "/scan").output.count("- 1.5\n") == 200
    unknown = domain.run("echo", "--once", "--field", "date", "/kept").output
    assert unknown == "ERROR: std_msgs/msg/String has no field [date]"
    assert domain.run("echo", "/kept", "std_msgs/msg/Int32").output == (
        "ERROR: topic [/kept] has the type std_msgs/msg/String, not std_msgs/msg/Int32"
    )


def test_a_rate_is_printed_until_ctrl_c(domain: Domain) -> None:
    hz = domain.start("hz", "/chatter")
    hz.wait_for(r"^average rate: \d+\.\d{3}$")
    hz.wait_for(r"^\tmin: \d\.\d{3}s max: \d\.\d{3}s std dev: \d\.\d{5}s window: \d+$")
    hz.send_signal(signal.SIGINT)
    assert hz.wait(30) == 0
    assert "Traceback" not in hz.output


def test_messages_are_published(domain: Domain) -> None:
    printed = domain.run("pub", "--once", "/heard", "std_msgs/msg/String", "{data: hello}").output

    domain.node.wait_for("^heard hello$")
    assert printed == "publisher: beginning loop\npublishing #1: std_msgs.msg.String(data='hello')\n"
    publisher = domain.start("pub", "-r", "20", "/heard", "std_msgs/msg/String", "{data: again}")
    domain.node.wait_for("^heard again$")
    publisher.send_signal(signal.SIGINT)
    assert publisher.wait(30) == 0


def test_services_are_called(domain: Domain) -> None:
    assert domain.run("call", "/switch", "std_srvs/srv/SetBool", "{data: true}").output.endswith(
        "requester: making request: std_srvs.srv.SetBool_Request(data=True)\n\n"
        "response:\nstd_srvs.srv.SetBool_Response(success=True, message='é')\n"
    )
    missing = domain.run("call", "--timeout", "0.5", "/nothing", "std_srvs/srv/SetBool")
    assert (missing.returncode, missing.lines[-1]) == (1, "ERROR: service [/nothing] is not available")


def test_each_error_is_one_line(domain: Domain) -> None:
    for words, error in (
        (("pub", "/heard", "String"), "a type must have the form package/msg/Name, got [String]"),
        (("pub", "/", "std_msgs/msg/Int8", "{a: 1}"), "std_msgs/msg/Int8 has no field [a]; its fields: data"),
        (("pub", "/heard", "std_msgs/msg/String", "{data: 1}"), "data must be a text, got 1"),
        (("echo", "/n"), "topic [/n] does not appear to be published yet; give its type to wait for it"),
    ):  # fmt: skip
        failed = domain.run(*words)
        assert (failed.returncode, failed.output) == (1, f"ERROR: {error}")
