"""ros_comm#1083, #492, #156, #2111: simulated time was set back, or had no clock, and loops hung silently."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros.node.clock import TimeMovedBackwards
from pipros.node.rate import Rate, Timer
from pipros.node.timings import NodeTimings
from tests.support.nodes import MakeNode, listening_log, wait_until_connected
from tests.support.waiting import wait_until

Clock: Any = load_message_class("rosgraph_msgs/Clock")

S = 1_000_000_000


class Simulator:
    """Publish the simulated time."""

    def __init__(self, make_node: MakeNode, node: Node) -> None:
        self.publisher = make_node("simulator").advertise("/clock", Clock, queue_size=10)
        self.node = node
        wait_until_connected(self.publisher)

    def set(self, seconds: float) -> None:
        self.publisher.publish(Clock(Time.from_sec(seconds)))
        wait_until(lambda: self.node.clock.now_ns() == int(seconds * S))


@pytest.fixture
def node(make_node: MakeNode) -> Node:
    node = make_node("node")
    node.use_simulated_time()
    return node


def test_a_sleeper_is_notified_when_time_is_set_back(make_node: MakeNode, node: Node) -> None:
    simulator, told = Simulator(make_node, node), []
    simulator.set(100)

    def sleep() -> None:
        try:
            node.clock.sleep(10)
        except TimeMovedBackwards as error:
            told.append(error.jump_s)

    sleeper = threading.Thread(target=sleep, daemon=True)
    sleeper.start()
    wait_until(lambda: simulator.set(101) or told or sleeper.is_alive())
    # A thread that is not sleeping yet misses the jump, so jumps are repeated until it sleeps.
    wait_until(lambda: simulator.set(50) or simulator.set(51) or told)
    assert told[0] < 0


def test_a_loop_with_reset_continues_after_time_was_set_back(make_node: MakeNode, node: Node) -> None:
    simulator, turns = Simulator(make_node, node), []
    simulator.set(1000)

    def loop() -> None:
        rate = Rate(node.clock, S, reset=True)
        while rate.sleep():
            turns.append(node.clock.now_ns() / S)

    threading.Thread(target=loop, daemon=True).start()
    ticks = iter(range(1001, 10_000))
    wait_until(lambda: simulator.set(next(ticks)) or len(turns) >= 3)
    simulator.set(10)
    ticks = iter(range(11, 1000))
    wait_until(lambda: simulator.set(next(ticks)) or (turns[-1] > 12 and turns[-1] < 1000))


def test_a_timer_with_reset_continues_after_time_was_set_back(make_node: MakeNode, node: Node) -> None:
    simulator, calls = Simulator(make_node, node), []
    simulator.set(1000)
    timer = Timer(node.clock, S, lambda tick: calls.append(tick.current_real_ns / S), reset=True)
    ticks = iter(range(1001, 10_000))
    wait_until(lambda: simulator.set(next(ticks)) or len(calls) >= 3)
    simulator.set(10)
    ticks = iter(range(11, 1000))
    wait_until(lambda: simulator.set(next(ticks)) or (calls[-1] > 12 and calls[-1] < 1000))
    timer.shutdown()


def test_a_sleeper_without_a_clock_gets_a_warning(make_node: MakeNode) -> None:
    log, lines = listening_log()
    node = make_node("node", log=log, timings=NodeTimings(clock_silence_s=0.05))
    node.use_simulated_time()
    threading.Thread(target=node.clock.sleep, args=(1,), daemon=True).start()
    wait_until(lambda: lines)
    assert "/clock" in lines[0]
    assert "/use_sim_time" in lines[0]
