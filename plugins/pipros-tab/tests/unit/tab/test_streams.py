"""Streams between the workers of a tab, over a hub in this process."""

from __future__ import annotations

import signal
from types import FrameType

import pytest

from pipros_tab.network import WINDOW_BYTES, Network, TabStream
from pipros_tab.packets import PacketKind
from tests.support.tab_hub import MemoryPort, Switch


@pytest.fixture
def switch() -> Switch:
    return Switch()


class Ends:
    """Two workers with a connection, and the streams of both ends."""

    def __init__(self, switch: Switch) -> None:
        self.ports = MemoryPort(switch), MemoryPort(switch)
        self.client_network, self.server_network = map(Network, self.ports)
        self.port, self.arrived = self.server_network.listen(0)
        self.client = self.client_network.connect(self.port)
        self.pass_packets()
        self.server: TabStream = self.arrived.popleft()

    def pass_packets(self) -> None:
        self.client_network.receive(0.0)
        self.server_network.receive(0.0)


@pytest.fixture
def ends(switch: Switch) -> Ends:
    return Ends(switch)


def read(stream: TabStream, count: int = 1 << 20) -> bytes:
    buffer = bytearray(count)
    return bytes(buffer[: stream.read_into(memoryview(buffer))])


def test_bytes_arrive_in_order_in_both_directions(ends: Ends) -> None:
    assert (ends.client.write(memoryview(b"one ")), ends.client.write(memoryview(b"two"))) == (4, 3)
    assert ends.server.write(memoryview(b"answer")) == 6
    ends.pass_packets()
    assert (read(ends.server, 2), read(ends.server), read(ends.client)) == (b"on", b"e two", b"answer")


def test_a_stream_without_bytes_would_block(ends: Ends) -> None:
    assert not ends.server.is_readable
    with pytest.raises(BlockingIOError):
        read(ends.server)


def test_a_reader_that_does_not_read_stops_the_writer_at_the_window(ends: Ends) -> None:
    data = memoryview(bytes(WINDOW_BYTES + 1))
    assert ends.client.write(data) == WINDOW_BYTES
    assert not ends.client.is_writable
    with pytest.raises(BlockingIOError):
        ends.client.write(memoryview(b"x"))
    ends.pass_packets()
    assert len(read(ends.server)) == WINDOW_BYTES
    ends.pass_packets()
    assert ends.client.is_writable
    assert ends.client.write(data) == WINDOW_BYTES


def test_a_refused_connection_has_an_error(switch: Switch) -> None:
    network = Network(MemoryPort(switch))
    stream = network.connect(9)
    assert not stream.is_writable
    with pytest.raises(BlockingIOError):
        stream.write(memoryview(b"early"))
    network.receive(0.0)
    assert stream.is_readable
    assert stream.is_writable
    with pytest.raises(ConnectionRefusedError):
        read(stream)
    with pytest.raises(BrokenPipeError):
        stream.write(memoryview(b"late"))


def test_what_was_sent_before_the_end_can_be_read(ends: Ends) -> None:
    ends.client.write(memoryview(b"last"))
    ends.client.close()
    ends.client.close()
    ends.pass_packets()
    assert (read(ends.server), read(ends.server)) == (b"last", b"")
    with pytest.raises(BrokenPipeError):
        ends.server.write(memoryview(b"x"))
    ends.server.close()
    assert ends.ports[0].sent.count(PacketKind.RESET) == 1
    assert PacketKind.RESET not in ends.ports[1].sent


def test_after_finish_the_other_direction_works(ends: Ends) -> None:
    ends.client.finish()
    ends.client.finish()
    ends.pass_packets()
    assert read(ends.server) == b""
    ends.server.write(memoryview(b"answer"))
    ends.pass_packets()
    assert (read(ends.client), ends.ports[0].sent.count(PacketKind.FINISH)) == (b"answer", 1)


def test_a_stream_that_stopped_receiving_discards_data(ends: Ends) -> None:
    ends.client.write(memoryview(b"before"))
    ends.pass_packets()
    ends.server.stop_receiving()
    ends.client.write(memoryview(b"after"))
    ends.pass_packets()
    assert read(ends.server) == b""


def test_a_port_belongs_to_one_worker_until_it_is_closed(switch: Switch) -> None:
    first, second = Network(MemoryPort(switch)), Network(MemoryPort(switch))
    assert first.listen(11311)[0] == 11311
    with pytest.raises(OSError, match="in use"):
        second.listen(11311)
    waiting = second.connect(11311)
    first.receive(0.0)
    first.close_port(11311)
    second.receive(0.0)
    assert (read(waiting), second.listen(11311)[0]) == (b"", 11311)


def test_a_listener_that_does_not_accept_gets_a_limited_number_of_connections(switch: Switch) -> None:
    network = Network(MemoryPort(switch))
    port, arrived = network.listen(0)
    streams = [network.connect(port) for _ in range(130)]
    network.receive(0.0)
    network.receive(0.0)
    assert len(arrived) == 128
    assert [stream.is_finished for stream in streams[-3:]] == [False, True, True]


def test_a_silent_hub_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_tab.network._HUB_S", 0.01)
    switch = Switch()
    port = MemoryPort(switch)
    monkeypatch.setattr(port, "send", lambda *_: None)
    with pytest.raises(TimeoutError, match="the hub of the tab does not answer"):
        Network(port).listen(0)


def test_the_end_of_a_worker_ends_its_connections(switch: Switch, ends: Ends) -> None:
    switch.remove(ends.ports[0].member)
    ends.pass_packets()
    assert read(ends.server) == b""


def test_an_interrupt_calls_the_handler(switch: Switch) -> None:
    port = MemoryPort(switch)
    network = Network(port)
    handled: list[int] = []

    def handle(number: int, _frame: FrameType | None) -> None:
        handled.append(number)

    before = signal.signal(signal.SIGINT, handle)
    try:
        port.interrupts = 1
        network.receive(0.0)
        network.receive(0.0)
    finally:
        signal.signal(signal.SIGINT, before)
    assert handled == [signal.SIGINT]
