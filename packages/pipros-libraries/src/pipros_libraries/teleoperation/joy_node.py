"""`joy_node`: publishes the state of a joystick on the topic `joy`."""

from __future__ import annotations

import contextlib
import math
import os
import select
import sys
import time
from collections.abc import Iterator, Sequence
from typing import Any, Final

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.posix import READ
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import number, raw
from pipros_libraries.teleoperation.joystick import EVENT, Joystick, StickChange

RETRY_S: Final = 1.0
POLL_S: Final = 0.1
"""Interval between checks for node shutdown while the joystick is idle."""
INITIAL_S: Final = 0.1
"""Time for collecting the events that describe the initial state, before publishing it."""
_GET_NAME: Final = 0x80806A13
"""The ioctl request `JSIOCGNAME(128)`, which returns the device's name."""


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `joy_node` until the node is shut down. Retry every second if the device is missing or lost."""
    with roscpp_program("joy_node", "joy", argv) as (node, log):
        device = str(raw(node, "dev", "/dev/input/js0"))
        publisher = JoyPublisher(node, device)
        is_reported = False
        while not node.is_ending:
            try:
                descriptor = os.open(device, READ)
            except OSError as error:
                if not is_reported:
                    log.error(
                        "Couldn't open joystick %s (%s). Will retry every second.", device, error.strerror
                    )
                    is_reported = True
                node.wait_for_shutdown(RETRY_S)
                continue
            with contextlib.closing(os.fdopen(descriptor, "rb", buffering=0)):
                is_reported = False
                name = _name(descriptor)
                log.info("Opened joystick: %s (%s). deadzone_: %f.", device, name, publisher.deadzone)
                publisher.run(descriptor)
            if not node.is_ending:
                log.error("Connection to joystick device lost unexpectedly. Will reopen.")
                node.wait_for_shutdown(RETRY_S)
    return 0


class JoyPublisher:
    """Publishes the state of a joystick while its device is open."""

    def __init__(self, node: Node, device: str) -> None:
        self._node = node
        self._device = device
        self._message_class: Any = load_message_class("sensor_msgs/Joy")
        self._topic = node.advertise("joy", self._message_class, queue_size=1)
        self.deadzone = min(max(number(node, "deadzone", 0.05), 0.0), 0.9)
        rate = number(node, "autorepeat_rate", 0.0)
        self._repeat_s = 1.0 / rate if rate > 0 else math.inf
        self._due_s = math.inf
        """Time of the next publication, on the clock `time.monotonic`."""
        self._coalesce_s = max(number(node, "coalesce_interval", 0.001), 0.0)

    def run(self, descriptor: int) -> None:
        """Publish the state after each change, until the device is lost or the node is shut down.

        Button changes are published immediately. Axis changes are collected for `~coalesce_interval` and
        published together. If `~autorepeat_rate` is set, an unchanged state is published at that rate. If the
        device is lost, everything counts as released.
        """
        stick = Joystick(
            self.deadzone,
            is_sticky=raw(self._node, "sticky_buttons", False) is True,
            has_triggers=raw(self._node, "default_trig_val", False) is True,
        )
        delays = {StickChange.BUTTON: 0.0, StickChange.AXIS: self._coalesce_s, StickChange.INITIAL: INITIAL_S}
        self._due_s = math.inf
        for event in self._events(descriptor):
            now_s = time.monotonic()
            change = stick.apply(event) if event else StickChange.NOTHING
            self._due_s = min(self._due_s, now_s + delays.get(change, math.inf))
            if now_s >= self._due_s:
                self._publish(stick)
                self._due_s = now_s + self._repeat_s
        if not self._node.is_ending and any((*stick.axes, *stick.buttons)):
            stick.axes, stick.buttons = [0.0] * len(stick.axes), [0] * len(stick.buttons)
            self._publish(stick)

    def _publish(self, stick: Joystick) -> None:
        message = self._message_class(axes=stick.axes, buttons=stick.buttons)
        message.header.stamp, message.header.frame_id = stamp(self._node.clock), self._device
        self._topic.publish(message)

    def _events(self, descriptor: int) -> Iterator[bytes]:
        """Yield events until the device is lost or the node is shut down.

        Yield b"" when a publication may be due.
        """
        rest = b""
        while not self._node.is_ending:
            wait_s = min(max(self._due_s - time.monotonic(), 0.0), POLL_S)
            if select.select([descriptor], [], [], wait_s)[0]:
                try:
                    read = os.read(descriptor, 64 * EVENT.size)
                except OSError:
                    return
                if not read:
                    return
                rest += read
                while len(rest) >= EVENT.size:
                    yield rest[: EVENT.size]
                    rest = rest[EVENT.size :]
            yield b""


def _name(descriptor: int) -> str:
    """Return the device's name, as reported by the driver."""
    if sys.platform == "win32":
        return "Unknown"
    import fcntl

    answer = bytearray(128)
    try:
        fcntl.ioctl(descriptor, _GET_NAME, answer)
    except OSError:
        return "Unknown"
    return answer.partition(b"\0")[0].decode("utf-8", "replace")
