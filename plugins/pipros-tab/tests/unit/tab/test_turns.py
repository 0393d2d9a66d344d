"""The turns of a worker: event loops, links and jobs in one thread."""

import asyncio
import itertools
import signal
import sys
import threading
import time
from types import FrameType

import pytest

from pipros_tab.network import WINDOW_BYTES, Network, TabStream
from pipros_tab.packets import PacketKind
from pipros_tab.sockets import TabSelector, socketpair
from pipros_tab.tab_socket import TabSocket
from pipros_tab.turns import DEEPEST, END_S, WorkerTurns, distinct_ns
from tests.support.tab_hub import MemoryPort, Switch


@pytest.fixture
def turns(monkeypatch: pytest.MonkeyPatch) -> WorkerTurns:
    network = Network(MemoryPort(Switch()))
    turns = WorkerTurns(network)
    monkeypatch.setattr(TabSocket, "network", network, raising=False)
    monkeypatch.setattr(TabSocket, "wait", staticmethod(turns.wait_for_network), raising=False)
    monkeypatch.setattr(TabSocket, "by_descriptor", {})
    monkeypatch.setattr("socket.socketpair", socketpair)
    return turns


def never() -> bool:
    return False


def test_jobs_run_in_order_where_the_thread_waits(turns: WorkerTurns) -> None:
    done: list[int] = []
    turns.later(done.append, 1)
    turns.later(done.append, 2)
    assert done == []
    assert turns.wait(lambda: len(done) == 2, 5.0)
    assert done == [1, 2]


def test_an_exit_in_a_job_ends_this_job_alone(turns: WorkerTurns) -> None:
    done: list[int] = []
    turns.later(sys.exit)
    turns.later(done.append, 1)
    assert turns.wait(lambda: bool(done), 5.0)


def test_a_wait_without_work_ends_in_time(turns: WorkerTurns) -> None:
    before = time.monotonic()
    assert not turns.wait(never, 0.05)
    assert time.monotonic() - before >= 0.05


def test_a_wait_with_endless_work_ends(turns: WorkerTurns) -> None:
    def again() -> None:
        turns.later(again)

    again()
    assert not turns.wait(never, 0.01)


def test_a_job_that_waits_lets_others_run(turns: WorkerTurns) -> None:
    done: list[str] = []

    def first() -> None:
        turns.wait(lambda: "second" in done, 5.0)
        done.append("first")

    turns.later(first)
    turns.later(done.append, "second")
    turns.wait(lambda: len(done) == 2, 5.0)
    assert done == ["second", "first"]


def test_jobs_are_nested_to_a_limited_depth(turns: WorkerTurns) -> None:
    depths: list[int] = []

    def nest() -> None:
        depths.append(len(depths))
        turns.later(nest)
        turns.wait(never, 0.001)

    turns.later(nest)
    turns.wait(lambda: len(depths) >= DEEPEST, 5.0)
    assert len(depths) == DEEPEST


def test_the_last_job_runs_where_no_job_waits_after_a_moment(turns: WorkerTurns) -> None:
    done: list[object] = []

    def end() -> None:
        turns.sleep(0.001)  # it may wait itself
        done.append("the last")

    def loop_that_catches_errors() -> None:
        turns.at_last(end)
        while True:
            try:
                turns.wait(never, None)
            except Exception as error:
                done.append(error)

    def nested() -> None:
        turns.later(loop_that_catches_errors)
        turns.wait(lambda: "the last" in done, 30.0)
        done.append("not reached")

    turns.later(nested)
    assert turns.wait(lambda: bool(done), 5.0)
    assert done == ["the last"]


def test_jobs_that_end_by_themselves_are_not_ended(turns: WorkerTurns, monkeypatch) -> None:
    monkeypatch.setattr("pipros_tab.turns.END_S", 3.0)
    done: list[str] = []

    def job() -> None:
        turns.at_last(done.append, "the last")
        turns.sleep(0.01)
        done.append("job")

    turns.later(job)
    assert turns.wait(lambda: len(done) == 2, 30.0)
    assert done == ["job", "the last"]


def test_jobs_that_are_called_while_a_node_ends_end_too(turns: WorkerTurns) -> None:
    done: list[str] = []

    def end() -> None:
        turns.later(turns.sleep, 30.0)
        turns.later(done.append, "another")
        turns.sleep(2 * END_S)
        done.append("end")

    turns.later(turns.while_ending, end)
    turns.later(turns.sleep, 2 * END_S)
    assert turns.wait(lambda: len(done) == 2, 5.0)
    assert done == ["another", "end"]
    turns.later(lambda: (turns.sleep(2 * END_S), done.append("after")))
    assert turns.wait(lambda: len(done) == 3, 5.0)


def test_an_event_loop_runs_where_the_thread_waits(turns: WorkerTurns) -> None:
    loop = asyncio.SelectorEventLoop(TabSelector())
    turns.drive(loop)

    async def work() -> str:
        await asyncio.sleep(0.01)
        return "done"

    task = loop.create_task(work())
    assert turns.wait(task.done, 5.0)
    assert task.result() == "done"
    loop.close()
    assert not turns.wait(never, 0.0)


def test_a_wait_for_the_network_runs_no_jobs(turns: WorkerTurns) -> None:
    done: list[int] = []
    turns.later(done.append, 1)
    assert not turns.wait_for_network(never, 0.01)
    assert done == []


def test_a_link_is_called_when_its_socket_can_be_read(turns: WorkerTurns) -> None:
    reading, writing = socketpair()
    received: list[bytes] = []
    calls: list[int] = []

    def read() -> bool:
        calls.append(1)
        if reading.is_readable:
            received.append(reading.recv(1))
        return len(calls) < 2

    turns.read(reading, read)
    turns.wait(never, 0.01)
    assert len(calls) == 2  # once more, because it had more to do
    writing.send(b"x")
    assert turns.wait(lambda: bool(received), 5.0)
    reading.close()
    writing.close()
    turns.wait(never, 0.01)
    assert received == [b"x"]


def test_a_timer_is_repeated_until_it_returns_none(turns: WorkerTurns) -> None:
    times: list[float] = []

    def tick() -> float | None:
        times.append(time.monotonic())
        return 0.02 if len(times) < 3 else None

    turns.repeat(tick)
    assert not turns.wait(never, 0.2)
    assert len(times) == 3
    assert times[2] - times[0] >= 0.04


def test_publishing_takes_a_turn(turns: WorkerTurns) -> None:
    done: list[str] = []
    turns.later(done.append, "callback")
    turns.publishing(done.append)("message")
    assert done == ["message", "callback"]


def test_jobs_run_while_an_event_is_awaited(turns: WorkerTurns, monkeypatch: pytest.MonkeyPatch) -> None:
    def wait(condition: threading.Condition, timeout: float | None = None) -> bool:
        return turns.wait_for_condition(condition, timeout)

    monkeypatch.setattr(threading.Condition, "wait", wait)
    event = threading.Event()
    assert not event.wait(0.01)
    turns.later(event.set)
    assert event.wait(5.0)


def test_the_times_of_a_coarse_clock_differ() -> None:
    shown = iter((5_000_000, 5_000_000, 5_000_000, 6_000_000, 4_000_000))
    times = list(itertools.islice(distinct_ns(lambda: next(shown)), 5))
    assert times == [5_000_000, 5_001_000, 5_002_000, 6_000_000, 6_001_000]


# Streams between the workers of a tab, over a hub in this process.


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
