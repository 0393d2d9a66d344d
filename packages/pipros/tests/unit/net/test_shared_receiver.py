"""Subscribers refuse shared memory that could end them, or show them memory outside of a message."""

import array
import contextlib
import mmap
import os
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from pipros.basics.errors import ProtocolError
from pipros.net.busy_poll import PublishCount
from pipros.net.delivery_lock import DeliveryLock
from pipros.net.incoming import IncomingLink
from pipros.net.shared_receiver import DescriptorSocket, NoSharedMemory
from pipros.net.shared_segment import Segment
from pipros.wire.slot_frames import (
    DROP,
    OFFER,
    READY,
    SEGMENT,
    SLOT,
    ControlFrame,
    decode_acknowledgements,
    encode,
)
from tests.support.waiting import wait_until

if sys.platform != "win32":
    import fcntl

pytestmark = pytest.mark.needs("shared memory")
SLOT_BYTES, SLOTS = 8192, 4


class Publisher:
    """A publisher that sends any frames and descriptors to a real link."""

    def __init__(self, queue_size: int | None = None) -> None:
        theirs, self.sock = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        self.segment = Segment(1, SLOT_BYTES, SLOTS)
        self.read_end, self.write_end = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self.messages: list[bytes] = []
        self.errors: list[Exception | None] = []
        self.may_deliver = threading.Event()
        self.may_deliver.set()
        self.link = IncomingLink(
            DescriptorSocket(theirs), name="link", deliver=self._deliver, delivery_lock=DeliveryLock(),
            queue_size=queue_size, on_closed=lambda _, error: self.errors.append(error),
            published=PublishCount(), received_count=PublishCount(), limit_bytes=10_000_000,
        )  # fmt: skip
        self.link.start()
        self.offer()

    def _deliver(self, message: memoryview | bytes) -> None:
        assert self.may_deliver.wait(30)
        self.messages.append(bytes(message))

    def send(self, *frames: ControlFrame, descriptors: tuple[int, ...] = ()) -> None:
        data = b"".join(map(encode, frames))
        rights = (
            [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))] if descriptors else []
        )
        self.sock.sendmsg([data], rights)

    def offer(self) -> None:
        self.send(ControlFrame(OFFER, 0))
        assert self.sock.recv(100) == READY

    def introduce(self, descriptor: int | None = None, pipe: int | None = None) -> None:
        self.send(
            ControlFrame(SEGMENT, 1, SLOT_BYTES, SLOTS),
            descriptors=(
                self.segment.descriptor if descriptor is None else descriptor,
                self.write_end if pipe is None else pipe,
            ),
        )

    def put(self, index: int, message: bytes) -> None:
        self.segment.write(index, [message])
        self.send(ControlFrame(SLOT, 1, index, len(message)))

    def end_of_link(self) -> Exception:
        wait_until(lambda: self.errors)
        assert self.errors[0] is not None
        return self.errors[0]

    def close(self) -> None:
        self.may_deliver.set()
        self.sock.close()
        self.link.join(30)
        self.errors.clear()  # their tracebacks refer to the memory
        self.segment.close()
        os.close(self.read_end)
        os.close(self.write_end)


@pytest.fixture
def publisher() -> Iterator[Publisher]:
    before = len(os.listdir("/proc/self/fd"))
    publisher = Publisher()
    yield publisher
    publisher.close()
    assert len(os.listdir("/proc/self/fd")) == before, "no descriptor is left"


def test_messages_in_slots_and_in_the_stream_arrive_in_order(publisher: Publisher) -> None:
    publisher.introduce()
    publisher.put(0, b"first")
    publisher.sock.sendall(b"\x06\x00\x00\x00second")
    publisher.put(1, b"third")
    wait_until(lambda: len(publisher.messages) == 3)
    assert publisher.messages == [b"first", b"second", b"third"]
    assert publisher.link.statistics.bytes == sum(len(text) + 4 for text in publisher.messages)
    wait_until(lambda: os.read(publisher.read_end, 16) if publisher.link.statistics.frames == 3 else b"")


@pytest.mark.parametrize("frame", [
    ControlFrame(SLOT, 1, SLOTS, 10), ControlFrame(SLOT, 1, 1 << 60, 10),
    ControlFrame(SLOT, 1, 0, SLOT_BYTES + 1), ControlFrame(SLOT, 1, 0, 1 << 60), ControlFrame(SLOT, 2, 0, 10),
    ControlFrame(77, 1, 0, 10), ControlFrame(SEGMENT, 2, SLOT_BYTES, SLOTS),
    ControlFrame(SEGMENT, 2, 1 << 62, 4), ControlFrame(SEGMENT, 2, 4096, 1 << 40),
    ControlFrame(SEGMENT, 2, 0, 0),
])  # fmt: skip
def test_frames_outside_of_the_announced_memory_end_the_link(
    publisher: Publisher, frame: ControlFrame
) -> None:
    publisher.introduce()
    publisher.put(0, b"good")
    publisher.send(frame)
    assert isinstance(publisher.end_of_link(), ProtocolError)
    assert publisher.messages == [b"good"]


def test_a_message_before_any_memory_ends_the_link(publisher: Publisher) -> None:
    publisher.send(ControlFrame(SLOT, 1, 0, 10))
    assert isinstance(publisher.end_of_link(), NoSharedMemory)


def test_memory_that_could_shrink_is_refused(publisher: Publisher, tmp_path: Path) -> None:
    unsealed = os.memfd_create("open", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.ftruncate(unsealed, SLOT_BYTES * SLOTS)
    publisher.introduce(descriptor=unsealed)
    os.close(unsealed)
    assert "could shrink" in str(publisher.end_of_link())


def test_an_ordinary_file_is_refused(publisher: Publisher, tmp_path: Path) -> None:
    with (tmp_path / "file").open("w+b") as file:
        file.truncate(SLOT_BYTES * SLOTS)
        publisher.introduce(descriptor=file.fileno())
    assert isinstance(publisher.end_of_link(), NoSharedMemory)


def test_memory_that_is_smaller_than_announced_is_refused(publisher: Publisher) -> None:
    small = Segment(1, SLOT_BYTES, 1)
    publisher.introduce(descriptor=small.descriptor)
    small.close()
    assert "fewer than" in str(publisher.end_of_link())


def test_memory_beyond_that_of_a_topic_is_refused(publisher: Publisher) -> None:
    with closing(Segment(1, 2 << 20, 33)) as large:
        frame = ControlFrame(SEGMENT, 1, large.slot_bytes, large.slots)
        publisher.send(frame, descriptors=(large.descriptor, publisher.write_end))
        assert "33 times 2097152 bytes was announced" in str(publisher.end_of_link())


def test_acknowledgements_go_into_pipes_only(publisher: Publisher, tmp_path: Path) -> None:
    with (tmp_path / "file").open("w+b") as file:
        publisher.introduce(pipe=file.fileno())
    assert "must be a pipe" in str(publisher.end_of_link())
    assert (tmp_path / "file").read_bytes() == b""


def test_descriptors_that_no_frame_announced_end_the_link(publisher: Publisher) -> None:
    publisher.introduce()
    for _ in range(3):
        publisher.sock.sendmsg(
            [b"\x01\x00\x00\x00x"],
            [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [publisher.read_end]))],
        )
    assert "more descriptors" in str(publisher.end_of_link())


def test_many_descriptors_at_once_end_the_link(publisher: Publisher) -> None:
    publisher.send(
        ControlFrame(SEGMENT, 1, SLOT_BYTES, SLOTS), descriptors=(publisher.segment.descriptor,) * 100
    )
    assert "more descriptors" in str(publisher.end_of_link())


def test_a_full_pipe_does_not_block_the_subscriber(publisher: Publisher) -> None:
    full, blocking = os.pipe()
    publisher.introduce(pipe=blocking)
    os.set_blocking(blocking, False)
    with contextlib.suppress(BlockingIOError):
        while os.write(blocking, bytes(4096)):
            pass
    os.set_blocking(blocking, True)
    publisher.put(0, b"first")
    publisher.put(1, b"second")
    wait_until(lambda: publisher.messages == [b"first", b"second"])
    os.close(full)
    os.close(blocking)


def test_a_message_outlives_its_publisher_while_a_callback_reads_it(publisher: Publisher) -> None:
    publisher.may_deliver.clear()
    publisher.introduce()
    publisher.put(0, b"kept")
    publisher.sock.shutdown(socket.SHUT_RDWR)
    publisher.segment.close()
    publisher.may_deliver.set()
    wait_until(lambda: publisher.messages == [b"kept"] and publisher.errors)


def test_dropped_memory_is_unmapped(publisher: Publisher) -> None:
    publisher.introduce()
    publisher.put(0, b"message")
    wait_until(lambda: publisher.messages)
    assert "memfd:pipros" in Path("/proc/self/maps").read_text()
    mapped = Path("/proc/self/maps").read_text().count("memfd:pipros")
    publisher.send(ControlFrame(DROP, 1))
    wait_until(lambda: Path("/proc/self/maps").read_text().count("memfd:pipros") < mapped)


def test_a_slow_callback_with_a_queue_gets_the_newest_and_returns_the_others() -> None:
    with closing(Publisher(queue_size=1)) as publisher:
        publisher.introduce()
        publisher.may_deliver.clear()
        publisher.put(0, b"0")
        wait_until(lambda: not publisher.link.statistics.dropped)
        for index in (1, 2, 3):
            publisher.put(index, b"%d" % index)
        publisher.may_deliver.set()
        wait_until(lambda: publisher.messages[-1:] == [b"3"])
        returned: list[int] = []

        def read_more() -> bool:
            try:
                data = os.read(publisher.read_end, 4096)
            except BlockingIOError:
                data = b""
            returned.extend(slot[1] for slot, in_use in decode_acknowledgements(data) if not in_use)
            return sorted(returned) == [0, 1, 2, 3]

        wait_until(read_more)
        assert publisher.link.statistics.dropped + len(publisher.messages) == 4


def test_readers_cannot_change_the_memory() -> None:
    refused = (
        lambda descriptor: os.pwrite(descriptor, b"x", 0),
        lambda descriptor: os.ftruncate(descriptor, 0),
        lambda descriptor: os.ftruncate(descriptor, 2 * SLOT_BYTES * SLOTS),
        lambda descriptor: fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_WRITE),
        lambda descriptor: mmap.mmap(descriptor, SLOT_BYTES),
    )
    with closing(Segment(1, SLOT_BYTES, SLOTS)) as segment:
        segment.write(0, [b"constant"])
        reopened = os.open(f"/proc/self/fd/{segment.descriptor}", os.O_RDWR)
        for descriptor in (segment.descriptor, reopened):
            for attempt in refused:
                with pytest.raises(PermissionError):
                    attempt(descriptor)
        os.close(reopened)
        with mmap.mmap(segment.descriptor, SLOT_BYTES, prot=mmap.PROT_READ) as reading:
            assert reading[:8] == b"constant"
