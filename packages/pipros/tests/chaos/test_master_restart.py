"""The master is killed and restarted: nodes register again, and messages continue."""

from __future__ import annotations

import itertools
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from tests.support.ports import ClaimedPort
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until

COUNTERS = 4
Int32: Any = load_message_class("std_msgs/Int32")


class Scene:
    """A master in its own process, nodes that publish counters on one topic, and a listener."""

    def __init__(self, processes: Processes, port: ClaimedPort) -> None:
        self._processes = processes
        self.port = port
        self.master = MasterClient(port.uri, "/test", timeout_s=30)
        self.heard: dict[int, list[int]] = {number: [] for number in range(COUNTERS)}
        self._nodes: list[Node] = []
        self._counting: list[threading.Thread] = []
        self._end = threading.Event()

    def start_master(self, *options: str) -> Process:
        command = (sys.executable, "-m", "pipros_tools.cli.rosmaster", "--core", "-p", str(self.port.number))
        process = self._processes.start(*command, *options)
        wait_until(self.is_up)
        return process

    def is_up(self) -> bool:
        try:
            return self.master.get_pid() > 0
        except PiprosError:
            return False

    def start_nodes(self) -> None:
        listener = self._start_node("listener")
        listener.subscribe("count", Int32, self._hear)
        for counter in range(COUNTERS):
            publisher = self._start_node(f"counter_{counter}").advertise("count", Int32)
            wait_until(lambda found=publisher: found.connection_count == 1)
            thread = threading.Thread(target=self._count, args=(publisher, counter), daemon=True)
            thread.start()
            self._counting.append(thread)

    def _start_node(self, name: str) -> Node:
        node = Node(name, environment=Environment(master_uri=self.port.uri))
        self._nodes.append(node)
        node.start()
        return node

    def _count(self, publisher: Any, counter: int) -> None:
        for number in itertools.count():
            publisher.publish(Int32(counter * 1_000_000 + number))
            if self._end.wait(0.01):
                return

    def _hear(self, message: Any) -> None:
        counter, number = divmod(message.data, 1_000_000)
        self.heard[counter].append(number)

    def is_complete(self) -> bool:
        """Return True if all nodes are registered."""
        publishers, subscribers, _ = self.master.get_system_state()
        counting = next((nodes for topic, nodes in publishers if topic == "/count"), [])
        return len(counting) == COUNTERS and ["/count", ["/listener"]] in subscribers

    def hear_more(self, count: int = 30) -> None:
        """Wait until this number of further messages of each counter has arrived."""
        before = {counter: len(heard) for counter, heard in self.heard.items()}
        wait_until(lambda: all(len(self.heard[counter]) >= before[counter] + count for counter in before))

    def assert_nothing_was_missed(self) -> None:
        for heard in map(list, self.heard.values()):  # copies, because messages still arrive
            assert heard == list(range(heard[0], heard[0] + len(heard)))

    def close(self) -> None:
        self._end.set()
        for thread in self._counting:
            thread.join(30)
        for node in self._nodes:
            node.shutdown("end of the test")


@pytest.fixture
def scene(processes: Processes, claimed_port: ClaimedPort) -> Iterator[Scene]:
    found = Scene(processes, claimed_port)
    yield found
    found.close()


@pytest.mark.parametrize("does_resume", [False, True])
def test_nodes_register_again_and_no_message_is_missed(
    scene: Scene, tmp_path: Path, does_resume: bool
) -> None:
    options = ("--resume", str(tmp_path / "master.db")) if does_resume else ()
    first = scene.start_master(*options)
    scene.start_nodes()
    first.send_signal(signal.SIGKILL)
    first.wait()
    scene.hear_more()
    scene.start_master(*options)
    wait_until(scene.is_complete, timeout_s=60)
    scene.hear_more()
    assert scene.is_complete()
    scene.assert_nothing_was_missed()


def test_nodes_find_a_master_after_long_and_repeated_outages(scene: Scene) -> None:
    for _ in range(3):
        master = scene.start_master()
        if not scene.heard[0]:
            scene.start_nodes()
        wait_until(scene.is_complete, timeout_s=60)
        master.send_signal(signal.SIGKILL)
        master.wait()
        scene.hear_more(60)
    scene.assert_nothing_was_missed()
