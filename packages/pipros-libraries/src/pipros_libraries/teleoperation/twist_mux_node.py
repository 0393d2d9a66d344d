"""The node `twist_mux`, which forwards velocities from the source that priorities and locks select."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.rate import Timer
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus
from pipros_libraries.nodes.params import raw
from pipros_libraries.nodes.velocities import VelocityOutput
from pipros_libraries.teleoperation.velocity_mux import VelocityMux, VelocitySource, sources

DIAGNOSTICS_S: Final = 1.0
CHECK_NS: Final = NS_PER_S // 10
"""Interval at which the node checks whether the source of the last velocity has expired."""


class TwistMux:
    """Subscribes to the sources, and publishes `cmd_vel_out`."""

    def __init__(self, node: Node, inputs: Sequence[VelocitySource], locks: Sequence[VelocitySource]) -> None:
        """Advertise and subscribe. Blocks until the master answers."""
        twist: Any = load_message_class("geometry_msgs/Twist")
        flag: Any = load_message_class("std_msgs/Bool")
        self._mux = VelocityMux(inputs, locks)
        self._clock = node.clock
        self._lock = threading.Lock()
        self._output = VelocityOutput(node, "cmd_vel_out")
        for each in locks:
            node.subscribe(each.topic, flag, partial(self._on_lock, each), queue_size=1)
        self._inputs = {
            each.topic: node.subscribe(each.topic, twist, partial(self._on_velocity, each), queue_size=1)
            for each in inputs
        }
        self._moving: VelocitySource | None = None
        self._is_locked = False
        self._timer = Timer(node.clock, CHECK_NS, lambda _: self._check(), reset=True)

    def _on_velocity(self, one: VelocitySource, message: Any) -> None:
        with self._lock:
            if self._mux.passes(one, self._now_s()):
                self._output.publish(message)
                self._moving, self._is_locked = one if self._output.is_moving else None, False

    def _on_lock(self, one: VelocitySource, message: Any) -> None:
        with self._lock:
            self._mux.lock(one, bool(message.data), self._now_s())
        self._check()

    def _check(self) -> None:
        """Publish a zero velocity, once, if no source is in charge of the last velocity any more.

        While a lock masks that source, repeat it. Without it, a base that holds its last command would drive
        on.
        """
        with self._lock:
            now_s = self._now_s()
            if self._moving is not None and self._mux.is_masked(self._moving, now_s):
                self._is_locked, self._moving = True, None
            self._is_locked = self._is_locked and self._mux.level(now_s) > 0
            if self._is_locked:
                self._output.hold()
            elif self._moving is not None:
                if self._inputs[self._moving.topic].connection_count:
                    self._moving = self._mux.in_charge(self._moving, now_s)
                else:  # its publisher has ended
                    self._moving = None
                if self._moving is None:
                    self._output.stop()

    def values(self) -> dict[str, str]:
        """Return the state of inputs and locks for diagnostics."""
        with self._lock:
            return self._mux.values(self._now_s())

    def _now_s(self) -> float:
        return self._clock.now_ns() / NS_PER_S


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `twist_mux` until the node is shut down."""
    with roscpp_program("twist_mux", "twist_mux", argv) as (node, log):
        inputs, locks = (sources(raw(node, name), f"~{name}", log.critical) for name in ("topics", "locks"))
        mux = TwistMux(node, inputs, locks)
        diagnostics = LinkDiagnostics(node, "none")
        name = f"{node.name.removeprefix('/')}: Twist mux status"
        last_s, took_s = time.monotonic(), 0.0
        while not node.wait_for_shutdown(DIAGNOSTICS_S):
            now_s = time.monotonic()
            times = {"loop time in [sec]": f"{took_s:g}", "data age in [sec]": f"{now_s - last_s:g}"}
            diagnostics.publish([LinkStatus(name, LinkLevel.OK, "ok", {**mux.values(), **times})])
            last_s, took_s = now_s, time.monotonic() - now_s
    return 0
