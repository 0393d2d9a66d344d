"""A driver outlives every failure of its device, and never delays the end of its node."""

import logging
import threading
from collections.abc import Callable

import pytest

from pipros_libraries.nodes.retrying import DeviceError, DevicePort, Driver
from pipros_robot.perception.drivers.streams import Stream, StreamLost
from tests.support.nodes import MakeNode, listening_log
from tests.support.waiting import wait_until


class NoStream(Stream):
    """A connection that does nothing."""

    def __init__(self) -> None:
        self.closed = 0

    def close(self) -> None:
        self.closed += 1


def run(driver: Driver) -> tuple[threading.Thread, list[int]]:
    codes: list[int] = []
    thread = threading.Thread(target=lambda: codes.append(driver.run()), daemon=True)
    thread.start()
    return thread, codes


QUICK_S = (0.001, 0.01)


def test_an_outage_is_reported_once_and_so_is_its_end(make_node: MakeNode) -> None:
    node, stream, sessions = make_node("lidar"), NoStream(), []
    log, lines = listening_log()
    log.setLevel(logging.INFO)

    def session(_: Stream) -> None:
        sessions.append(len(sessions))
        if len(sessions) % 10 == 0:
            driver.report_data()
        raise StreamLost("lost /dev/x: gone")

    driver = Driver(node, log, DevicePort("/dev/x", lambda: stream), session, QUICK_S)
    thread, codes = run(driver)
    wait_until(lambda: len(sessions) >= 25)
    node.shutdown()
    thread.join()
    assert codes == [0]
    assert stream.closed == len(sessions)
    lost, works = "lost /dev/x: gone. Trying again until it works.", "/dev/x works again"
    assert lines[:5] == [lost, works, lost, works, lost]
    assert len(lines) <= 2 * len(sessions) // 10 + 1


def test_another_kind_of_failure_is_reported_too(make_node: MakeNode) -> None:
    node, failures = make_node("lidar"), []
    log, lines = listening_log()

    def fail() -> Stream:
        failures.append(len(failures))
        raise DeviceError("too hot") if len(failures) > 5 else StreamLost("not there")

    thread, _ = run(Driver(node, log, DevicePort("x", fail), lambda _: None, QUICK_S))
    wait_until(lambda: len(failures) >= 12)
    node.shutdown()
    thread.join()
    assert lines == [f"{each}. Trying again until it works." for each in ("not there", "too hot")]


@pytest.mark.parametrize("place", ["open", "session"])
def test_the_node_ends_while_the_device_blocks(make_node: MakeNode, place: str) -> None:
    node, blocked, forever = make_node("lidar"), threading.Event(), threading.Event()

    def block(*_: object) -> Stream:
        blocked.set()
        forever.wait()
        return NoStream()

    opened: Callable[[], Stream] = block if place == "open" else NoStream
    driver = Driver(node, logging.getLogger("test"), DevicePort("x", opened), block)
    thread, codes = run(driver)
    assert blocked.wait(60)
    node.shutdown()
    thread.join()
    assert codes == [0]
    assert not forever.is_set()
    forever.set()


def test_the_node_waits_until_the_session_has_stopped_the_motor(make_node: MakeNode) -> None:
    node, begun, stopped = make_node("lidar"), threading.Event(), threading.Event()

    def session(_: Stream) -> None:
        begun.set()
        while not driver.is_ending:
            threading.Event().wait(0.01)
        stopped.set()

    driver = Driver(node, logging.getLogger("test"), DevicePort("x", NoStream), session)
    thread, _ = run(driver)
    wait_until(begun.is_set)
    node.shutdown()
    assert stopped.is_set()
    thread.join()


def test_a_mistake_in_the_driver_ends_the_node_with_an_error(make_node: MakeNode) -> None:
    node = make_node("lidar")
    log, lines = listening_log()

    def session(_: Stream) -> None:
        raise ZeroDivisionError

    driver = Driver(node, log, DevicePort("x", NoStream), session)
    assert (driver.run(), lines) == (1, ["the driver of x failed"])
