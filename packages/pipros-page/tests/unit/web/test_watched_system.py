"""The observed system, with observers that fail or are rarely asked."""

import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.net.loop import BackgroundLoop
from pipros.node.any_msg import AnyMsg
from pipros_page import watched_system
from pipros_page.process_usage import usage_of
from pipros_page.topic_watch import TopicWatch
from pipros_page.watched_system import WatchedSystem
from pipros_tools.graph.observer import GraphObservation
from pipros_tools.graph.raw_decoder import RawDecoder
from tests.support.processes import Processes
from tests.support.waiting import wait_until


class ClumsyObserver:
    """Fails twice, and then succeeds."""

    def __init__(self, *_: object, **__: object) -> None:
        self.looks = 0

    def poll(self) -> GraphObservation:
        self.looks += 1
        if self.looks <= 2:
            raise IndexError("list index out of range")
        return GraphObservation(error=f"look {self.looks}")

    def close(self) -> None:
        pass


def test_polling_continues_after_an_error(monkeypatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(watched_system, "SystemObserver", ClumsyObserver)
    nothing: Any = SimpleNamespace(master=None)

    async def errors() -> list[str]:
        system = WatchedSystem(nothing, nothing, interval_s=0.01)
        system.start()
        found = []
        async for observation in system.observations():
            found.append(observation.error)
            if len(found) == 3:
                break
        system.close()
        return found

    loop = BackgroundLoop("test")
    loop.start()
    try:
        failure = "cannot observe the system: IndexError: list index out of range"
        assert loop.run(errors(), 60) == [failure, failure, "look 3"]
    finally:
        loop.stop()
    assert [record.getMessage() for record in caplog.records] == [failure]


def test_a_view_that_opens_between_two_looks_shows_the_last_one_at_once(monkeypatch) -> None:
    monkeypatch.setattr(
        watched_system, "SystemObserver", lambda *_, **__: SimpleNamespace(poll=GraphObservation)
    )
    nothing: Any = SimpleNamespace(master=None)

    async def observations() -> list[GraphObservation]:
        system = WatchedSystem(nothing, nothing, interval_s=600)
        system.start()
        found = [await anext(system.observations()) for _ in range(2)]
        system.close()
        return found

    loop = BackgroundLoop("test")
    loop.start()
    try:
        first, second = loop.run(observations(), 60)
    finally:
        loop.stop()
    assert second is first


# What a view that opens later receives of a topic that others already watch.


def message(body: bytes, sender: str, *, latching: bool) -> AnyMsg:
    made = AnyMsg(body)
    made._connection_header = {"callerid": sender, "latching": "1" if latching else "0"}
    return made


def received(watch: TopicWatch, *, from_newest: bool = True) -> list[bytes]:
    found: list[bytes] = []
    with watch.listening(lambda each, _: found.append(each.body), from_newest=from_newest):
        pass
    return found


def test_a_later_listener_gets_the_newest_message_of_each_latching_publisher() -> None:
    watch = TopicWatch("/tf_static", RawDecoder())
    for body, sender in ((b"a1", "/a"), (b"b1", "/b"), (b"a2", "/a")):
        watch.note(message(body, sender, latching=True))
    assert (received(watch), received(watch, from_newest=False)) == ([b"b1", b"a2"], [])
    watch.note(message(b"c", "/c", latching=False))
    assert received(watch) == [b"b1", b"a2", b"c"]


def test_latched_messages_beyond_the_limit_are_dropped_oldest_first() -> None:
    watch = TopicWatch("/map", RawDecoder(), limits=Limits.parse("page_message_bytes=100"))
    for number in range(4):
        watch.note(message(b"%d" % number * 40, f"/map{number}", latching=True))
    assert [body[:1] for body in received(watch)] == [b"2", b"3"]


# Resource usage from `/proc`.


PROGRAM = """
import sys, threading
print("one thread", flush=True)
sys.stdin.readline()
threading.Thread(target=threading.Event().wait, daemon=True).start()
print("two threads", flush=True)
sys.stdin.readline()
while True:
    sum(range(100_000))
"""


@pytest.mark.needs("/proc")
def test_a_process_has_memory_threads_and_processor_time(processes: Processes) -> None:
    # In the process of the tests, threads of earlier tests may end at any time.
    process = processes.start(sys.executable, "-I", "-S", "-c", PROGRAM, stdin=subprocess.PIPE)
    process.wait_for("one thread")
    before = usage_of(process.pid)
    assert before.memory_bytes > 1_000_000
    assert before.threads == 1
    assert before.files is not None
    process.write_line("")
    process.wait_for("two threads")
    more = usage_of(process.pid)
    assert (more.threads, more.start) == (2, before.start)
    process.write_line("")
    wait_until(lambda: _processor_s(process.pid) > before.processor_s, what="processor time")


def _processor_s(pid: int) -> float:
    usage = usage_of(pid)
    return usage.processor_s if usage else 0.0


def test_a_process_that_ended_has_no_usage() -> None:
    process = subprocess.Popen([sys.executable, "-c", "pass"])
    wait_until(lambda: usage_of(process.pid) is None, 30, "the end of the process")
    process.wait()
    assert usage_of(process.pid) is None
