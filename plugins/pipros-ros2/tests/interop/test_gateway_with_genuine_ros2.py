"""`pipros ros2` between a genuine rclpy node and a genuine rospy node, for each distribution on PyPI.

Both engines pass everything, except that the engine rclpy offers only actions whose types its ROS 2 has.
"""

import hashlib
import itertools
import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from pipros.msg import load_message_class
from tests.support.dds_peers import enable_multicast
from tests.support.environments import file_of_tests, genuine_environment
from tests.support.hunt import busy_processors
from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Process, Processes
from tests.support.ros2_wheels import DISTROS, environment
from tests.support.waiting import wait_until

pytestmark = needs_network
PYTHON = "/usr/bin/python3"
MASTER = "http://localhost:11311"
RULES = """
topics: {to_ros1: {allow: ["/r2_*"]}}
services: {to_ros1: {allow: [/r1_switch]}, to_ros2: {allow: [/r2_switch]}}
actions: {to_ros1: {allow: [/r1_fibonacci]}, to_ros2: {allow: [/r2_fibonacci]}}
"""
# test_msgs has the only actions on PyPI. The second rule offers the action of ROS 1 under another name, too.
MAPPING = """
- ros1_package_name: actionlib_tutorials
  ros1_action_name: Fibonacci
  ros2_package_name: test_msgs
  ros2_action_name: Fibonacci
- ros1_package_name: actionlib_tutorials
  ros1_action_name: Fibonacci
  ros2_package_name: example_interfaces
  ros2_action_name: Fibonacci
"""
BIG_BYTES = 8_000_000
NUMBERS = ("reliable", "best_effort")
ACTIONS = {"dds": ("example_interfaces", "test_msgs"), "rclpy": ("test_msgs",)}
"""The packages of actions by which each engine offers the action of ROS 1."""


class System:
    """A master, a gateway, and a node on each side of it, in a network of their own."""

    def __init__(self, distro: str, engine: str, folder: Path, network: LoneNetwork) -> None:
        self.engine = engine
        self._distro = distro
        self._environment = environment(distro)
        self._network = network
        self._folder = folder
        self._processes = Processes(genuine_environment(folder, MASTER), folder)
        self._memory = folder / "shm"
        self._memory.mkdir()
        self._rules = folder / "rules.yaml"
        self._rules.write_text(RULES)
        self._mapping = folder / "mapping.yaml"
        self._mapping.write_text(MAPPING)
        self._fibonacci = folder / "fibonacci"
        self._fibonacci.write_text(load_message_class("actionlib_tutorials/FibonacciAction")._full_text)
        enable_multicast(network)
        self._pipros("rosmaster", "--core")
        self.gateway = self.start_gateway()
        self.ros2 = self.start_ros2()
        self.ros1 = self.start_ros1()

    def _pipros(self, command: str, *words: str | Path) -> Process:
        program = Path(sys.executable).parent / command
        argv = self._with_memory(str(program), *map(str, words))
        return self._processes.start(*argv, environment={"ROS_IP": "127.0.0.1"})

    def _with_memory(self, *argv: str) -> list[str]:
        """Return a command in the network, with shared memory that only such commands have.

        Programs that were killed leave files there.
        """
        mount = 'mount --bind "$0" /dev/shm && exec "$@"'
        return self._network.command("sh", "-c", mount, str(self._memory), *argv)

    def start_gateway(self) -> Process:
        python = ("--ros2-python", self._environment / "bin" / "python") if self.engine == "rclpy" else ()
        gateway = self._pipros(
            *("pipros", "ros2", "--domain", "0", "--distro", self._distro, "--rules", self._rules),
            *("--mapping", self._mapping, "--msgs", self._environment / "share"),
            *python,
        )
        gateway.wait_for("connected to domain")
        return gateway

    def start_ros2(self) -> Process:
        return self._node(
            str(self._environment / "bin" / "python"),
            str(file_of_tests("interop/programs/genuine_ros2_node.py")),
        )

    def start_ros1(self) -> Process:
        return self._node(
            PYTHON, str(file_of_tests("interop/programs/genuine_ros1_node.py")), str(self._fibonacci)
        )

    def _node(self, *argv: str) -> Process:
        node = self._processes.start(*self._with_memory(*argv), stdin=-1)
        node.wait_for("^ready$")
        return node

    def check_topics(self) -> None:
        """Check that numbers arrive on both sides from now on, all of them on reliable topics."""
        marks = self.ros1.mark(), self.ros2.mark()
        for node, prefix, mark in ((self.ros1, "/r2", marks[0]), (self.ros2, "/r1", marks[1])):
            for name in NUMBERS:
                node.wait_for(f"^at {prefix}_{name} ", since=mark)
        for node, prefix, mark in ((self.ros1, "/r2", marks[0]), (self.ros2, "/r1", marks[1])):
            after = node.mark()
            node.wait_for(f"^at {prefix}_reliable ", since=after)
            assert f"gap {prefix}_reliable" not in "\n".join(node.lines[after:]), mark

    def check_calls(self) -> None:
        """Check that the service of each side answers the other."""
        for node, answer in ((self.ros1, "answer False by rclpy"), (self.ros2, "answer False by rospy")):
            mark = node.mark()
            node.write_line("call 1")
            node.wait_for(f"^{answer}$", since=mark)

    def check_goals(self) -> None:
        """Check that goals of each side succeed at the other, with feedback."""
        for node, status in ((self.ros1, 3), (self.ros2, 4)):
            mark = node.mark()
            node.write_line("send_goal 6")
            node.wait_for(f"^result {status} 0 1 1 2 3 5$", since=mark)
            node.wait_for("^feedback$", since=mark)

    def close(self) -> None:
        self._processes.end_all()


@contextmanager
def running(distro: str, engine: str, folder: Path) -> Iterator[System]:
    with (
        closing(LoneNetwork("127.0.0.1 localhost\n")) as network,
        closing(System(distro, engine, folder, network)) as system,
    ):
        yield system


@pytest.fixture(scope="module", params=itertools.product(DISTROS, ACTIONS), ids="-".join)
def system(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    with running(*request.param, tmp_path_factory.mktemp("ros2")) as system:
        yield system


def test_topics_pass_in_both_directions_without_gaps(system: System) -> None:
    system.check_topics()


def test_bursts_from_ros2_arrive_without_gaps(system: System) -> None:
    system.check_topics()
    start = system.ros1.mark()
    for _ in range(8):
        mark = system.ros1.mark()
        system.ros2.write_line("burst 100")
        for _ in range(10):  # the node prints each tenth number
            system.ros1.wait_for("^at /r2_reliable ", since=mark)
            mark += 1
    after = system.ros1.mark()
    system.ros1.wait_for("^at /r2_reliable ", since=after)
    assert "gap /r2_reliable" not in "\n".join(system.ros1.lines[start:])


def test_late_subscribers_get_latched_messages(system: System) -> None:
    for node, text in ((system.ros1, "kept in ROS 2"), (system.ros2, "kept in ROS 1")):
        node.write_line("subscribe_late")
        node.wait_for(f"^latched {text}$")


def test_fields_that_ros2_has_renamed_and_embedded_messages_keep_their_values(system: System) -> None:
    for node in (system.ros1, system.ros2):
        node.wait_for(r"^camera plumb_bob 0\.0 1\.0 2\.0 3\.0 4\.0 5\.0 6\.0 7\.0 8\.0$")
        node.wait_for(r"^imu 1\.0 4\.0 9$")


def test_messages_of_8_mb_pass_in_both_directions(system: System) -> None:
    size = BIG_BYTES // 256 * 256
    digest = hashlib.sha256(bytes(range(256)) * (size // 256)).hexdigest()
    for sender, receiver in ((system.ros1, system.ros2), (system.ros2, system.ros1)):
        mark = receiver.mark()

        def is_connected(sender: Process = sender, receiver: Process = receiver, mark: int = mark) -> bool:
            sender.write_line("send_big 256")
            return any(line.startswith("big 256 ") for line in receiver.lines[mark:])

        wait_until(is_connected, 60)
        sender.write_line(f"send_big {size}")
        receiver.wait_for(f"^big {size} {digest}$")


def test_services_answer_in_both_directions(system: System) -> None:
    system.check_calls()


def test_goals_succeed_in_both_directions(system: System) -> None:
    system.check_goals()


def test_goals_are_cancelled_in_both_directions(system: System) -> None:
    # A genuine client of ROS 1 may miss that the goal is active, if that comes before send_goal has returned.
    for node, status in ((system.ros1, 2), (system.ros2, 5)):
        mark = node.mark()
        node.write_line("send_goal 2000")
        node.wait_for("^feedback$", since=mark)
        if node is system.ros2:  # which may print feedback before it has the goal that it is to cancel
            node.wait_for("^accepted True$", since=mark)
        node.write_line("cancel")
        node.wait_for(f"^result {status} 0 1 1", since=mark)


def test_the_gateway_is_a_node_of_ros2_with_actions_of_all_names(system: System) -> None:
    mark = system.ros2.mark()
    names = " ".join(f"{package}/action/Fibonacci" for package in ACTIONS[system.engine])
    patterns = ("^nodes .*kit ros1_gateway_", f"^action /r1_fibonacci {names}$")

    def is_known() -> bool:  # what rclpy has discovered so far
        system.ros2.write_line("nodes")
        text = "\n".join(system.ros2.lines[mark:])
        return all(re.search(each, text, re.MULTILINE) for each in patterns)

    wait_until(is_known, 60, lambda: system.ros2.output)


def test_the_node_of_ros2_complains_about_nothing(system: System) -> None:
    assert [line for line in system.ros2.stderr if "WARN" in line or "ERROR" in line] == []
    assert [line for line in system.gateway.lines if "does not match" in line] == []


def test_everything_passes_on_busy_processors(system: System) -> None:
    with busy_processors():
        system.check_topics()
        system.check_calls()
        system.check_goals()


def test_everything_passes_again_after_a_restart_of_each_part(system: System) -> None:
    system.gateway.press_ctrl_c()
    system.gateway.wait()
    system.gateway = system.start_gateway()
    system.check_topics()
    system.check_calls()

    system.ros2.kill()
    system.ros2 = system.start_ros2()
    system.ros1.kill()
    system.ros1 = system.start_ros1()
    system.check_topics()
    system.check_calls()
    system.check_goals()


def test_a_gateway_whose_rclpy_ends_says_so_and_ends(tmp_path: Path) -> None:
    with running(DISTROS[0], "rclpy", tmp_path) as system:
        (agent,) = (
            int(pid)
            for children in Path(f"/proc/{system.gateway.pid}/task").glob("*/children")
            for pid in children.read_text().split()
        )
        os.kill(agent, signal.SIGKILL)

        assert system.gateway.wait() == 1
        assert "ERROR: the process of rclpy ended with exit code -9" in system.gateway.output


# Genuine rclpy goes on after large messages that lose datagrams and are displaced before they arrive.


@pytest.mark.parametrize("loss", [0.1, 0.2])
@pytest.mark.parametrize("distro", DISTROS)
def test_rclpy_takes_later_messages_and_ends_after_lost_fragments(
    distro: str, loss: float, tmp_path: Path, processes: Processes
) -> None:
    """Fast DDS's `take` never returns if a GAP names a sample of which the reader has fragments."""
    network = LoneNetwork("127.0.0.1 localhost\n")
    try:
        enable_multicast(network)
        python = str(environment(distro) / "bin" / "python")
        private = 'mount -t tmpfs shm /dev/shm && exec "$@"'
        words = (
            "sh", "-c", private, "sh", python,
            str(file_of_tests("interop/programs/genuine_ros2_listener.py")),
        )  # fmt: skip
        listener = processes.start(*network.command(*words))
        listener.wait_for("^ready$")
        talker = processes.start(
            *network.command(sys.executable, str(file_of_tests("interop/programs/lossy_texts.py")), str(loss))
        )

        talker.wait_for("^sent$")
        listener.wait_for("^short [0-9]+ recent$")
        listener.send_signal(signal.SIGINT)
        listener.wait()  # its exit code depends on where rclpy and Python notice the signal
    finally:
        processes.end_all()
        network.close()
