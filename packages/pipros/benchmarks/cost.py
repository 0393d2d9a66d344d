#!/usr/bin/env python3
"""Processor time of a message, of publisher and subscriber apart: pipros, rospy and roscpp, in one run.

    script/bench cost [--only "cost Image 1 MB"] [--rounds 3] [--seconds 2] [--quick]

The time is that of whole processes, with all threads, after some messages and a second, divided by the number
of messages; a lost message is an error. At full speed with a queue, a window limits the messages in transit.
At the rates of cameras, "pipros over TCP" is pipros with PIPROS_LOCAL=off. `--only` takes no commas.
"""

import functools
import sys
from contextlib import contextmanager

from client import flow
from worlds import World, compare, open_worlds

OVER_TCP = "pipros over TCP"
# For each message: its kind, the window at full speed, and the rates in Hz; 0 is full speed.
MESSAGES = {
    "String 16 B": ("string", 500, (10, 100, 1000, 0)),
    "Image 10 kB": ("image:10000", 100, (100, 0)),
    "Image 100 kB": ("image:100000", 16, (20, 0)),
    "Image 1 MB": ("image", 8, (20, 100, 0)),
    "PointCloud2 4 MB": ("cloud", 4, (10, 0)),
}
CAMERA_HZ = range(10, 31)


class TcpWorld(World):
    """pipros without shared memory and Unix streams."""

    def __init__(self):
        super().__init__(OVER_TCP, sys.executable, {"PIPROS_LOCAL": "off"})

    def has(self, name):
        """Include images and clouds at the rates of cameras."""
        return name in CAMERAS


def cost(label, kind, window, rate_hz, queue, world, seconds):
    """Return the processor time of both ends."""
    paced_by_window = queue is not None and not rate_hz
    published, (received,) = flow(
        kind, queue, window if paced_by_window else 0, world, seconds, rate_hz=rate_hz
    )
    if received["seen"] != published["sent"]:
        raise SystemExit(f"{world.name}: {label}: {received['seen']} of {published['sent']} messages arrived")
    end = "us of the {}'s processor time per message"
    return {
        f"{label}: {end.format(name)}": found["cpu"] / published["sent"] * 1e6
        for name, found in (("publisher", published), ("subscriber", received))
    }


@contextmanager
def open_with_tcp():
    with open_worlds(roscpp=True) as worlds:
        world = TcpWorld()
        try:
            yield [*worlds[:-1], world, worlds[-1]]
        finally:
            world.close()


def points():
    """Return the rates and the workloads, by name."""
    for name, (kind, window, rates) in MESSAGES.items():
        for rate_hz in rates:
            for queue in (None, 1000):
                label = f"{name} at {f'{rate_hz} Hz' if rate_hz else 'full speed'}, queue_size={queue}"
                yield f"cost {label}", rate_hz, functools.partial(cost, label, kind, window, rate_hz, queue)


WORKLOADS = {name: workload for name, _, workload in points()}
CAMERAS = {name for name, rate_hz, _ in points() if rate_hz in CAMERA_HZ and "String" not in name}
QUICK = {
    name for name in WORKLOADS if name.startswith(("cost String 16 B at 100 Hz", "cost Image 1 MB at 20 Hz"))
}


if __name__ == "__main__":
    compare(__doc__, WORKLOADS, globals(), opened=open_with_tcp(), quick=QUICK)
