"""Recorders and masters that are killed, and a subscriber that stops."""

import itertools
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32, UInt8MultiArray

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits
from pipros.net.master_client import MasterClient
from pipros.net.timings import LinkTimings
from pipros.node import Node
from pipros.node.timings import NodeTimings
from pipros.wire.header import HeaderReader, encode_header
from pipros_tools.bag import BagReader, NotIndexed
from pipros_tools.cli.rosbag import main
from tests.support.bags import rows_of
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.ports import ClaimedPort
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until

# A recording that is killed at any moment loses at most the current chunk. There are ten kills;
# `PIPROS_KILLED_RECORDINGS=200 script/test -k killed_recording` makes more.


RUNS = int(os.environ.get("PIPROS_KILLED_RECORDINGS", "10"))
COMPRESSIONS = ("none", "lz4", "bz2")

WRITER = """
import sys, zlib
from pipros_tools.bag.connection import StoredMessage, received_connection
from pipros_tools.bag.record_files import FileOptions, RecordFiles
from std_msgs.msg import String

header = {"type": "std_msgs/String", "md5sum": String._md5sum, "message_definition": String._full_text}
options = FileOptions(name="run", split=True, size_bytes=60_000, chunk_bytes=3000, compression=sys.argv[1])
files = RecordFiles(options, lambda _: None)
connection = received_connection("/text", header)
files.open(0)
written = 0
while True:
    text = b"%d " % written + b"%x" % zlib.crc32(b"%d" % written) * (written % 40)
    files.write(StoredMessage(connection, written * 10**9, len(text).to_bytes(4, "little") + text))
    written += 1
    if written % 100 == 0:
        files.flush()
        print(written, flush=True)
"""


def killed_after(acknowledged: int, folder: Path, compression: str) -> int:
    """Kill a writer after a number of its reports about the file; return the last number that it
    reported."""
    argv = [sys.executable, "-c", WRITER, compression]
    with subprocess.Popen(argv, cwd=folder, stdout=subprocess.PIPE, text=True) as writer:
        told = [writer.stdout.readline() for _ in range(acknowledged)]
        writer.send_signal(signal.SIGKILL)
        told += writer.stdout.readlines()
    return max(int(line) for line in told if line.endswith("\n"))


def numbers(path: Path, *, is_rebuilt: bool = False) -> list[int]:
    with BagReader(path, rebuild_index=is_rebuilt) as bag:
        return [int(row[1].split()[0]) for row in rows_of(bag)]


@pytest.mark.timeout(60 + 3 * RUNS)
def test_a_killed_writer_loses_only_the_current_chunk(tmp_path: Path) -> None:
    seed = random.randrange(10**6)  # noqa: S311
    chance = random.Random(seed)  # noqa: S311
    for run in range(RUNS):
        folder = tmp_path / str(run)
        folder.mkdir()
        told = killed_after(chance.randrange(1, 40), folder, COMPRESSIONS[run % 3])
        files = sorted(folder.glob("run_*"), key=lambda path: int(path.name.split("_")[1].split(".")[0]))

        found: list[int] = []
        for path in files:
            if path.suffix == ".bag":
                found += numbers(path)  # complete, with its index
                continue
            if not path.stat().st_size:
                continue  # killed just after the file was created
            rebuilt = numbers(path, is_rebuilt=True)
            try:
                assert (
                    numbers(path) == rebuilt
                )  # killed after the index was written, before the file was renamed
            except NotIndexed:
                assert (main(["reindex", "-q", str(path)]), numbers(path)) == (0, rebuilt)
            found += rebuilt

        assert found == list(range(len(found))), f"seed {seed}, run {run}"
        assert len(found) >= told, f"seed {seed}, run {run}"


# The master is killed and restarted: nodes register again, and messages continue.


COUNTERS = 4


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
def test_nodes_register_again_and_miss_no_message(scene: Scene, tmp_path: Path, does_resume: bool) -> None:
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


# A subscriber that stops reading, among healthy ones.


HEALTHY = 5
COUNT = 300
SIZE = 60_000


def numbered(number: int) -> Any:
    return UInt8MultiArray(data=struct.pack("<I", number) * (SIZE // 4))


def number_of(message: Any) -> int:
    number: int = struct.unpack_from("<I", message.data)[0]
    return number


@pytest.mark.parametrize("queue_size", [None, 1, 10])
def test_five_subscribers_miss_nothing_while_a_sixth_is_stopped_and_later_catches_up(
    make_node: MakeNode, queue_size: int | None
) -> None:
    # A subscriber that does not read is still alive, and must not be dropped like one that vanished.
    # On a busy machine, even the system of a live peer may acknowledge probes late.
    links = LinkTimings(check_peer_interval_s=0.01, unanswered_s=1.0)
    talker, listeners = (
        make_node("talker", limits=Limits(stall_s=0.05), timings=NodeTimings(links=links)),
        [make_node(f"listener{number}") for number in range(HEALTHY)],
    )
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=queue_size)
    inboxes = [Inbox() for _ in listeners]
    for listener, inbox in zip(listeners, inboxes, strict=True):
        listener.subscribe("chat", UInt8MultiArray, inbox)
    with socket.create_connection(("127.0.0.1", talker.endpoints.port), 30) as stopped:
        stopped.sendall(encode_header({"topic": "/chat", "md5sum": "*", "callerid": "/stopped"}))
        wait_until_connected(publisher, HEALTHY + 1)
        longer_than_limit = time.monotonic() + 2 * links.unanswered_s

        for number in range(COUNT):
            publisher.publish(numbered(number))
            for inbox in inboxes:  # at its own speed
                inbox.wait(number + 1)
        for inbox in inboxes:
            assert [number_of(message) for message in inbox.messages] == list(range(COUNT))
        wait_until(lambda: time.monotonic() > longer_than_limit)
        links = talker.statistics()["publications"]["/chat"]
        assert links["/stopped"].dropped > COUNT // 2
        assert [links[f"/listener{number}"].dropped for number in range(HEALTHY)] == [0] * HEALTHY

        numbers = Reader(stopped)
        wait_until(lambda: numbers.next() == COUNT - 1)
        assert numbers.seen == sorted(numbers.seen)
        publisher.publish(numbered(COUNT))
        assert numbers.next() == COUNT


class Reader:
    """Reads messages from a socket after its connection header."""

    def __init__(self, sock: socket.socket) -> None:
        self.sock = sock
        self.seen: list[int] = []
        reader = HeaderReader()
        while reader.feed(sock.recv(16)) is None:
            pass
        self.rest = reader.rest

    def next(self) -> int:
        (length,) = struct.unpack("<I", self.take(4))
        self.seen.append(number_of(UInt8MultiArray().deserialize(self.take(length))))
        return self.seen[-1]

    def take(self, count: int) -> bytes:
        while len(self.rest) < count:
            data = self.sock.recv(1 << 20)
            assert data
            self.rest += data
        taken, self.rest = self.rest[:count], self.rest[count:]
        return taken
