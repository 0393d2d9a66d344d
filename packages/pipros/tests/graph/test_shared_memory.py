"""Large messages in shared memory: subscribers, limits, failures, hostile peers."""

import array
import errno
import os
import pickle
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import numpy
import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import String

from pipros.basics.limits import Limits
from pipros.net import local_stream, shared_memory, shared_segment
from pipros.net.outgoing_state import LinkState
from pipros.net.shared_memory import SHARED_TOPIC_BYTES
from pipros.net.timings import LinkTimings
from pipros.node import Node
from pipros.node.timings import NodeTimings
from pipros.wire.header import encode_header
from pipros.wire.slot_frames import (
    ACCEPTED,
    FRAME_BYTES,
    HEADER_FIELD,
    OFFER,
    READY,
    SEGMENT,
    SLOT,
    decode,
    encode_acknowledgement,
)
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.waiting import wait_until

pytestmark = pytest.mark.skipif(not local_stream.shares_memory(), reason="needs shared memory of Linux")

SIZE = 300_000
WARM = "warm"


def image(number: int, size: int = SIZE) -> Any:
    return Image(data=bytes([number % 256]) * size, encoding=str(number))


def is_intact(message: Any) -> bool:
    return bool(bytes(message.data) == image(int(message.encoding), len(message.data)).data)


def numbers(messages: list[Any]) -> list[int]:
    assert all(map(is_intact, messages))
    return [int(message.encoding) for message in messages]


def memory_of(publisher: Any) -> Any:
    memory = publisher.publication.memory
    assert memory is not None
    return memory


class Images(Inbox):
    """A callback that stores the images, except those of `warm_up`."""

    def __call__(self, message: Any) -> None:
        if message.encoding != WARM:
            super().__call__(message)


def listening(make_node: MakeNode, publisher: Any, *callbacks: Any, **options: Any) -> int:
    """Subscribe a node for each callback. Return the number of messages published to make memory ready."""
    for number, callback in enumerate(callbacks):
        make_node(f"listener{number}").subscribe("images", Image, callback, **options)
    wait_until_connected(publisher, len(callbacks))
    return warm_up(publisher)


def warm_up(publisher: Any) -> int:
    """Publish until all subscribers have accepted shared memory. Return the number of messages.

    None of them waits in a stream afterwards: as long as one does, the next message follows it there.
    """
    links = [peer.link for peer in publisher.publication.links]
    count = 0

    def are_ready() -> bool:
        nonlocal count
        count += 1
        publisher.publish(Image(data=bytes(SIZE), encoding=WARM))
        return all(link.memory.is_ready for link in links)

    wait_until(are_ready)
    wait_until(lambda: all(link.state is LinkState.IDLE for link in links))
    return count


def count_mapped() -> int:
    with open("/proc/self/maps") as file:
        return file.read().count("memfd:pipros")


def count_open(kind: str) -> int:
    links = Path("/proc/self/fd").iterdir()
    return sum(str(link.readlink()).lstrip("/").startswith(kind) for link in links if link.is_symlink())


@pytest.fixture(autouse=True)
def _without_leaks(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for switch in (local_stream.SWITCH, local_stream.MEMORY_SWITCH):
        monkeypatch.delenv(switch, raising=False)
    yield
    wait_until(lambda: not count_mapped(), what="no memory is left")


# -- messages ---------------------------------------------------------------------------


@pytest.mark.parametrize("queue_size", [None, 1000])
def test_five_subscribers_get_all_messages_in_order(make_node: MakeNode, queue_size: int | None) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=queue_size)
    inboxes = [Images() for _ in range(5)]
    before = listening(make_node, publisher, *inboxes)
    sizes = [SIZE, 100, 40_000, SIZE, 2 * SIZE]
    for number in range(60):
        publisher.publish(image(number, sizes[number % 5]))
    assert memory_of(publisher).used_bytes
    for inbox in inboxes:
        assert numbers(inbox.wait(60)) == list(range(60))
        assert type(inbox.messages[0].data) is bytes
    wait_until(lambda: publisher.statistics()["frames"] == 5 * (before + 60))


def test_statistics_are_those_of_the_stream(make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for switch in ("on", "off"):
        monkeypatch.setenv("PIPROS_SHARED_MEMORY", switch)
        publisher = make_node(f"talker_{switch}").advertise(f"images_{switch}", Image, queue_size=None)
        inboxes, subscribers = [Inbox(), Inbox()], []
        for number, inbox in enumerate(inboxes):
            listener = make_node(f"listener_{switch}{number}")
            subscribers.append(listener.subscribe(f"images_{switch}", Image, inbox))
        wait_until_connected(publisher, 2)
        for number in range(20):
            publisher.publish(image(number))
        for inbox in inboxes:
            inbox.wait(20)
        assert (publisher.publication.memory is not None) == (switch == "on")
        wait_until(lambda: all(each.statistics()["frames"] == 20 for each in subscribers))  # noqa: B023
        found.append([publisher.statistics(), *(subscriber.statistics() for subscriber in subscribers)])
    assert found[0] == found[1]


def test_a_subscriber_without_copies_gets_read_only_arrays_of_shared_memory(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    kinds: list[Any] = []

    def look(message: Any) -> None:
        if message.encoding != WARM:
            kinds.append((type(message.data), message.data.flags.writeable, is_intact(message)))

    listening(make_node, publisher, look, zero_copy=True)
    for number in range(20):
        publisher.publish(image(number, 10 if number == 5 else SIZE))
    wait_until(lambda: len(kinds) == 20)
    assert kinds == 20 * [(numpy.ndarray, False, True)]
    assert memory_of(publisher).used_bytes


def test_arrays_that_are_kept_never_change_and_lose_no_messages(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    kept: list[Any] = []

    def keep(message: Any) -> None:
        if message.encoding != WARM:
            message.data = message.data[100:].reshape(-1, 100)[::2]
            kept.append(message)

    listening(make_node, publisher, keep, zero_copy=True)
    for number in range(30):
        publisher.publish(image(number))
    wait_until(lambda: len(kept) == 30)
    for number, message in enumerate(kept):
        assert message.encoding == str(number)
        assert (message.data == number).all()
        with pytest.raises(ValueError, match="WRITEABLE"):
            message.data.setflags(write=True)
    memory = memory_of(publisher)
    kept.clear()
    publisher.publish(image(30))
    wait_until(lambda: len(kept) == 1)
    assert memory.used_bytes
    kept.clear()


def test_callbacks_of_both_kinds_share_a_topic_with_latched_messages(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None, latch=True)
    publisher.publish(image(1))
    listener = make_node("listener")
    plain, viewing, late = Inbox(), Inbox(), Inbox()
    listener.subscribe("images", Image, plain)
    plain.wait(1)
    listener.subscribe("images", Image, viewing, zero_copy=True)
    publisher.publish(image(2))
    listener.subscribe("images", Image, late, zero_copy=True)
    for inbox, kind in ((plain, bytes), (viewing, numpy.ndarray), (late, numpy.ndarray)):
        wait_until(lambda: inbox.messages and inbox.messages[-1].encoding == "2")  # noqa: B023
        assert all(type(message.data) is kind and is_intact(message) for message in inbox.messages)
    for inbox in (plain, viewing, late):
        inbox.messages.clear()


@pytest.mark.parametrize("switch", ["PIPROS_LOCAL", "PIPROS_SHARED_MEMORY"])
def test_zero_copy_without_shared_memory_gives_the_same_arrays(make_node, monkeypatch, switch: str) -> None:
    monkeypatch.setenv(switch, "off")
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    kept: list[Any] = []
    make_node("listener").subscribe("images", Image, kept.append, zero_copy=True)
    wait_until_connected(publisher)
    for number in range(10):
        publisher.publish(image(number, SIZE if number % 3 else 50))
    wait_until(lambda: len(kept) == 10)
    assert numbers(kept) == list(range(10))
    assert all(type(message.data) is numpy.ndarray and not message.data.flags.writeable for message in kept)
    assert publisher.publication.memory is None


def test_zero_copy_messages_behave_as_documented(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    again = make_node("relay").advertise("again", Image, queue_size=None)
    inbox, relayed = Inbox(), Inbox()
    make_node("listener").subscribe("images", Image, inbox, zero_copy=True)
    make_node("last").subscribe("again", Image, relayed)
    wait_until_connected(publisher)
    wait_until_connected(again)
    publisher.publish(image(7))
    message = inbox.wait(1)[0]
    with pytest.raises(ValueError, match="ambiguous"):
        bool(message.data)
    assert (message.data == bytes([7]) * SIZE).__class__ in (bool, numpy.ndarray, numpy.bool_)
    assert is_intact(pickle.loads(pickle.dumps(message)))  # noqa: S301 - pickled above
    again.publish(message)
    assert numbers(relayed.wait(1)) == [7]
    inbox.messages.clear()


def test_a_subscriber_that_joins_others_misses_nothing(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=1000)
    listening(make_node, publisher, lambda _: None, zero_copy=True)
    inbox = Images()
    subscriber = make_node("late").subscribe("images", Image, inbox)
    wait_until_connected(publisher, 2)
    for number in range(30):
        publisher.publish(image(number))
    assert numbers(inbox.wait(30)) == list(range(30))
    assert subscriber.statistics()["links_ended"] == 0


# -- subscribers that stop, end, or misbehave ---------------------------------------------

LISTENER = """
import sys, time
from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.net.timings import LinkTimings
from pipros.node import Node
from pipros.node.timings import NodeTimings
node = Node(sys.argv[2], environment=Environment(master_uri=sys.argv[1]))
node.start()
kept = []
def take(message):
    if message.encoding != "warm":
        kept.append(message)
        del kept[:-2]
        print(message.encoding, flush=True)
node.subscribe("images", load_message_class("sensor_msgs/Image"), take, zero_copy=True)
time.sleep(1000)
"""


@pytest.fixture
def start_listener() -> Iterator[Any]:
    started: list[subprocess.Popen[str]] = []

    def start(uri: str, name: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", LISTENER, uri, name]
        started.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_a_subscriber_killed_with_slots_leaves_nothing_behind(make_node, master, start_listener: Any) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    pipes = count_open("pipe:")
    for number in range(3):
        listener = start_listener(master.uri, f"listener{number}")
        wait_until_connected(publisher, 1)
        warm_up(publisher)
        for count in range(5):
            publisher.publish(image(count))
        assert listener.stdout.readline() == "0\n"
        assert memory_of(publisher).used_bytes
        listener.kill()
        wait_until(lambda: publisher.connection_count == 0)
        memory = memory_of(publisher)
        wait_until(lambda: memory.held_slots == 0)  # noqa: B023
    wait_until(lambda: count_open("memfd:pipros") <= 2)  # the segment, and its mapping
    assert count_open("pipe:") <= pipes + 3, "only those to the programs"


def test_a_stopped_subscriber_delays_no_other_and_gets_the_newest_afterwards(
    make_node: MakeNode, master: Any, start_listener: Any
) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=2)
    inbox = Images()
    make_node("good").subscribe("images", Image, inbox)
    stopped = start_listener(master.uri, "stopped")
    wait_until_connected(publisher, 2)
    warm_up(publisher)
    stopped.send_signal(signal.SIGSTOP)
    for number in range(100):
        publisher.publish(image(number))
        inbox.wait(number + 1)
    assert numbers(inbox.messages) == list(range(100))
    stopped.send_signal(signal.SIGCONT)
    seen = []
    while seen[-1:] != [99]:
        seen.append(int(stopped.stdout.readline()))
    assert seen == sorted(seen)
    assert len(seen) < 50


class Stranger:
    """A subscriber that reads frames and sends any acknowledgement."""

    def __init__(self, node: Node) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(30)
        self.sock.connect(f"\0{node.endpoints.local_name}")
        fields = {"topic": "/images", "type": Image._type, "md5sum": Image._md5sum, "callerid": "/stranger"}
        self.sock.sendall(encode_header({**fields, HEADER_FIELD: ACCEPTED}))
        (length,) = struct.unpack("<I", self._read(4))
        self._read(length)
        self.descriptors: list[int] = []

    def accept(self, publisher: Any) -> None:
        """Read a first large message, and accept the offer of memory."""

        def read() -> None:
            assert self.read_frame().kind == OFFER
            (length,) = struct.unpack("<I", self._read(4))
            self._read(length)
            self.sock.sendall(READY)

        reading = threading.Thread(target=read)
        reading.start()
        publisher.publish(image(0))
        reading.join(30)
        link = publisher.publication.links[0].link
        wait_until(lambda: link.memory.is_ready and link.state is LinkState.IDLE)

    def _read(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            received = self.sock.recv(count - len(data))
            assert received
            data += received
        return data

    def read_frame(self) -> Any:
        data, rights, _, _ = self.sock.recvmsg(FRAME_BYTES, 64)
        for _, _, numbers in rights:
            self.descriptors += array.array("i", numbers)
        return decode(data)

    def acknowledge(self, data: bytes) -> None:
        os.write(self.descriptors[1], data)

    def close(self) -> None:
        self.sock.close()
        for descriptor in self.descriptors:
            os.close(descriptor)


def visited(talker: Node) -> tuple[Any, Stranger]:
    """Return a publisher of images, and a stranger that has accepted its memory."""
    publisher, stranger = talker.advertise("images", Image, queue_size=1000), Stranger(talker)
    wait_until_connected(publisher)
    stranger.accept(publisher)
    return publisher, stranger


@pytest.mark.parametrize("attack", ["another slot", "another segment", "half", "twice", "close"])
def test_a_subscriber_that_lies_loses_its_link_and_its_slots(make_node: MakeNode, attack: str) -> None:
    log, lines = listening_log()
    publisher, stranger = visited(make_node("talker", log=log))
    publisher.publish(image(0))
    assert stranger.read_frame().kind == SEGMENT
    slot = stranger.read_frame()
    assert slot.kind == SLOT
    held = slot.segment, slot.first
    if attack == "close":
        os.close(stranger.descriptors.pop(1))
    else:
        stranger.acknowledge(
            {
                "another slot": encode_acknowledgement((held[0], held[1] - 1), in_use=False),
                "another segment": encode_acknowledgement((77, 0), in_use=True),
                "half": encode_acknowledgement(held, in_use=False)[:4],
                "twice": 2 * encode_acknowledgement(held, in_use=False),
            }[attack]
        )
    publisher.publish(image(1))
    wait_until(lambda: publisher.connection_count == 0)
    if attack != "close":  # a subscriber that ends may close its pipe first
        wait_until(lambda: any("/stranger" in line for line in lines))
    assert memory_of(publisher).held_slots == 0
    stranger.close()


def test_a_subscriber_that_never_acknowledges_loses_only_its_own_messages(make_node: MakeNode) -> None:
    publisher, stranger = visited(make_node("talker"))
    inbox = Inbox.of(make_node("good"), "images", Image)
    wait_until_connected(publisher, 2)
    for number in range(30):
        publisher.publish(image(number))
    assert numbers(inbox.wait(30)) == list(range(30))
    stranger.close()


class Blocking(Images):
    """A callback that blocks until `go` is set."""

    def __init__(self) -> None:
        super().__init__()
        self.go = threading.Event()

    def __call__(self, message: Any) -> None:
        if message.encoding != WARM:
            assert self.go.wait(60)
        super().__call__(message)


def test_as_many_slots_wait_for_a_subscriber_as_its_queue_holds(make_node: MakeNode) -> None:
    timings = NodeTimings(links=LinkTimings(keep_memory_s=0.2))
    publisher = make_node("talker", timings=timings).advertise("images", Image, queue_size=20)
    inbox = Blocking()
    listening(make_node, publisher, inbox)
    memory = memory_of(publisher)
    for number in range(20):
        publisher.publish(image(number))
    assert memory.held_slots >= 19, "the publisher may still see the last message of the warm-up"
    inbox.go.set()
    assert numbers(inbox.wait(20)) == list(range(20))
    slot_bytes = memory._current.slot_bytes
    wait_until(
        lambda: publisher.publish(image(20)) or (memory.used_bytes <= 3 * slot_bytes and count_mapped() <= 2),
        what="the memory of the burst is freed",
    )


def test_a_publisher_waits_now_and_then_for_a_stream_to_return_to_memory(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=50)
    inbox = Blocking()
    listening(make_node, publisher, inbox)
    link: Any = publisher.publication.links[0].link
    for number in range(40):
        publisher.publish(image(number))
    assert link.state is LinkState.QUEUED, "a stream holds less than the messages beyond half of the slots"
    link._next_return_s = 0.0
    assert link.is_briefly_waited_for
    assert not link.is_briefly_waited_for, "once in a while"
    inbox.go.set()
    assert numbers(inbox.wait(40)) == list(range(40))
    wait_until(lambda: link.state is LinkState.IDLE)
    publisher.publish(image(40))
    assert numbers(inbox.wait(41))[-1] == 40


def test_a_subscriber_that_hangs_costs_four_others_nothing(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=50)
    hanging, inboxes = Blocking(), [Images() for _ in range(4)]
    listening(make_node, publisher, hanging, *inboxes)
    for number in range(200):
        publisher.publish(image(number))
        for inbox in inboxes:
            inbox.wait(number + 1)
    for inbox in inboxes:
        assert numbers(inbox.messages) == list(range(200))
    memory = memory_of(publisher)
    assert 25 <= memory.held_slots <= 34, "half of the slots, those of the last message, and of the warm-up"
    assert memory.used_bytes <= memory.limit_bytes
    hanging.go.set()
    wait_until(lambda: hanging.messages and numbers(hanging.messages)[-1] == 199)
    assert numbers(hanging.messages) == sorted(numbers(hanging.messages))
    publisher.publish(image(200))
    assert numbers(inboxes[0].wait(201))[-1] == 200


def test_a_callback_that_forks_or_ends_its_process_returns_no_slot_of_its_parent(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    seen: list[Any] = []

    def fork(message: Any) -> None:
        if message.encoding == WARM:
            return
        child = os.fork()
        if not child:
            del message  # in the child, this is the last reference
            os._exit(0)
        os.waitpid(child, 0)
        seen.append(message.encoding)

    listening(make_node, publisher, fork, zero_copy=True)
    for number in range(10):
        publisher.publish(image(number))
    wait_until(lambda: len(seen) == 10)
    assert (publisher.connection_count, publisher.statistics()["dropped"]) == (1, 0)


def test_large_messages_of_forked_children_do_not_break_links_of_their_parent(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    inbox, children = Inbox(), []
    listening(make_node, publisher, lambda message: message.encoding == WARM or inbox(message))
    for number in range(10):
        if not (child := os.fork()):
            try:
                publisher.publish(image(number + 100))
            finally:
                os._exit(0)
        children.append(child)
        publisher.publish(image(number))
    for child in children:
        os.waitpid(child, 0)
    publisher.publish(image(10))
    wait_until(lambda: numbers(inbox.messages)[-1:] == [10])
    assert numbers(inbox.messages) == list(range(11))
    assert publisher.statistics()["dropped"] == 0


# -- limits and failures ------------------------------------------------------------------


def publish_to_two(
    make_node: MakeNode, count: int = 10, size: int = SIZE, **options: Any
) -> tuple[Any, list[str]]:
    """Publish to two subscribers, which get everything. Return the publisher and the lines of its log."""
    log, lines = listening_log()
    publisher = make_node("talker", log=log, **options).advertise("images", Image, queue_size=None)
    inboxes = Images(), Images()
    listening(make_node, publisher, *inboxes)
    for number in range(count):
        publisher.publish(image(number, size))
    for inbox in inboxes:
        assert numbers(inbox.wait(count)) == list(range(count))
    return publisher, [line for line in lines if "shared memory" in line]


@pytest.mark.parametrize(
    ("call", "code"),
    [
        ("posix_fallocate", errno.ENOSPC), ("posix_fallocate", errno.ENOMEM), ("memfd_create", errno.EMFILE),
        ("pipe2", errno.EMFILE), ("ftruncate", errno.EFBIG),
    ],
)  # fmt: skip
def test_messages_use_the_stream_with_one_log_line_if_the_system_refuses(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch, call: str, code: int
) -> None:
    def refuse(*arguments: Any) -> int:
        raise OSError(code, os.strerror(code))

    module = shared_memory if call == "pipe2" else shared_segment
    monkeypatch.setattr(module.os, call, refuse)
    publisher, lines = publish_to_two(make_node)
    assert len(lines) == 1, lines
    assert os.strerror(code) in lines[0]
    assert memory_of(publisher).held_slots == 0


def test_messages_beyond_limits_use_the_stream_with_a_log_line(make_node, constants: Constants) -> None:
    constants(SHARED_TOPIC_BYTES=SIZE)
    publisher, lines = publish_to_two(make_node)
    assert len(lines) == 1
    assert f"the limit is {SIZE} bytes" in lines[0]
    assert memory_of(publisher).used_bytes == 0


def test_all_topics_of_a_node_share_one_limit(make_node: MakeNode) -> None:
    limit = 1_500_000
    log, lines = listening_log()
    talker = make_node("talker", log=log, limits=Limits(shared_bytes=limit))
    listeners = [make_node(f"listener{number}") for number in range(2)]
    publishers, inboxes = [], []
    for number in range(5):
        publishers.append(talker.advertise(f"images{number}", Image, queue_size=None))
        for listener in listeners:
            inboxes.append(Images())
            listener.subscribe(f"images{number}", Image, inboxes[-1])
    for publisher in publishers:
        wait_until_connected(publisher, 2)
        warm_up(publisher)
        publisher.publish(image(1))
        publisher.publish(image(2))
    for inbox in inboxes:
        assert numbers(inbox.wait(2)) == [1, 2]
    used = [memory_of(publisher).used_bytes for publisher in publishers]
    assert 0 < sum(used) <= limit
    assert 0 in used
    refused = sum("shared_bytes in PIPROS_LIMITS" in line for line in lines)
    assert used.count(0) <= refused <= len(publishers)


def test_growing_messages_get_larger_slots_and_the_memory_of_before_is_freed(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    inboxes = Images(), Images()
    listening(make_node, publisher, *inboxes)
    sizes = [200_000, 500_000, 200_000, 2_000_000, 100, 500_000]
    for number, size in enumerate(sizes):
        publisher.publish(image(number, size))
    for inbox in inboxes:
        assert [len(message.data) for message in inbox.wait(len(sizes))] == sizes
    publisher.publish(image(9))
    memory = memory_of(publisher)
    wait_until(lambda: publisher.publish(image(9)) or memory.used_bytes < 7 * 2_600_000)
    wait_until(lambda: publisher.publish(image(9)) or count_mapped() <= 3)


def test_memory_is_freed_after_some_time_without_large_messages(make_node: MakeNode) -> None:
    timings = NodeTimings(links=LinkTimings(keep_memory_s=0.2))
    publisher, _ = publish_to_two(make_node, timings=timings)
    memory = memory_of(publisher)
    wait_until(lambda: memory.used_bytes == 0 and not count_mapped())
    publisher.publish(image(0))
    wait_until(lambda: memory.used_bytes)


def test_log_topics_need_no_shared_memory(make_node: MakeNode) -> None:
    publisher, inbox = make_node("talker").advertise("/rosout", String, queue_size=None), Inbox()
    make_node("listener").subscribe("/rosout", String, inbox)
    wait_until_connected(publisher)
    text = "x" * SIZE
    publisher.publish(String(text))
    publisher.publish(String(text))
    assert [message.data for message in inbox.wait(2)] == [text, text]
    assert publisher.publication.memory is None


def test_memory_that_was_just_used_is_kept_even_if_the_event_loop_is_late(make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("images", Image, queue_size=None)
    listening(make_node, publisher, Inbox())
    publisher.publish(image(0))
    memory = memory_of(publisher)
    assert memory.used_bytes

    def has_returned() -> bool:
        with memory._lock:
            for link in memory._links:
                memory._collect(link)
        return bool(memory.held_slots == 0)

    wait_until(has_returned)
    memory._drop_current()  # the event loop, which looked at the time before the message
    assert memory.used_bytes


def test_bus_info_names_the_memory_and_its_limit(make_node: MakeNode) -> None:
    talker = make_node("talker")
    publisher = talker.advertise("images", Image, queue_size=None)
    listening(make_node, publisher, Inbox(), Inbox())
    publisher.publish(image(0))
    with ServerProxy(talker.uri) as slave:
        rows: Any = slave.getBusInfo("/test")
    used = memory_of(publisher).used_bytes
    assert used
    remark = f"shared memory: {used} of at most {SHARED_TOPIC_BYTES} bytes"
    assert [row[6].rpartition(", ")[2] for row in rows[2]] == 2 * [remark]


REAL_LIMITS = """
import resource, sys, time
from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.timings import LinkTimings
from pipros.node import Node
from pipros.node.timings import NodeTimings
kind, value = getattr(resource, sys.argv[1]), int(sys.argv[2])
Image = load_message_class("sensor_msgs/Image")
with Master(port=0) as master:
    nodes = [Node(name, environment=Environment(master_uri=master.uri)) for name in ("a", "b", "c")]
    for node in nodes:
        node.start()
    publisher = nodes[0].advertise("x", Image, queue_size=None)
    inboxes = [], []
    for node, inbox in zip(nodes[1:], inboxes):
        node.subscribe("x", Image, inbox.append)
    while publisher.connection_count < 2:
        time.sleep(0.01)
    publisher.publish(Image(data=bytes(300_000)))  # offers memory; another one could use it before the limit
    while not all(peer.link.memory.is_ready for peer in publisher.publication.links):
        time.sleep(0.01)
    for inbox in inboxes:
        while not inbox or inbox[-1].header.seq != publisher.publication.encoder.sequence:
            time.sleep(0.01)
        inbox.clear()
    before = resource.getrlimit(kind)
    resource.setrlimit(kind, (value, before[1]))
    for number in range(20):
        publisher.publish(Image(data=bytes([number]) * 300_000))
    while min(map(len, inboxes)) < 20:
        time.sleep(0.01)
    assert all(message.data == bytes([n]) * 300_000 for inbox in inboxes for n, message in enumerate(inbox))
    print("served", publisher.publication.memory.used_bytes)
    resource.setrlimit(kind, before)
    for node in nodes:
        node.shutdown("the end")
"""


# No descriptor from 3 on can be opened: with a greater limit, one that another thread has closed could be.
@pytest.mark.parametrize(("limit", "value"), [("RLIMIT_FSIZE", 100_000), ("RLIMIT_NOFILE", 3)])
def test_limits_of_the_process_lead_back_to_the_stream(limit: str, value: int) -> None:
    command = [sys.executable, "-c", REAL_LIMITS, limit, str(value)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.stdout.startswith("served"), ended.stderr
