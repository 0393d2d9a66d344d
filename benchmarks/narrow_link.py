"""A slow link on one machine: a network namespace behind two TUN devices, with delay and packet loss.

Needs root. A thread forwards packets between the devices, because not every kernel has netem. Like a modem's
link, each direction has its own bandwidth and queue. Packets that arrive at a full queue are also lost.
"""

import contextlib
import fcntl
import heapq
import itertools
import os
import random
import select
import struct
import subprocess
import threading
import time

HERE, THERE = "10.213.7.1", "10.213.7.2"
_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x400454CA, 1, 0x1000
_QUEUE_S = 0.2
_MTU = 1400


class NarrowLink:
    """A network namespace at the other end of a link; a context manager.

    Attributes:
        prefix: beginning of command lines for programs in the namespace. `HERE` is the address of this side.
        lost: number of lost packets.
    """

    def __init__(self, kbit, delay_s, loss, seed=1):
        self._bytes_per_s = kbit * 1000 / 8
        self._delay_s, self._loss = delay_s, loss
        self._random = random.Random(seed)  # noqa: S311
        self._name = f"narrow{os.getpid()}"
        self._stack = contextlib.ExitStack()
        self._is_over = threading.Event()
        self.prefix = ["ip", "netns", "exec", self._name]
        self.lost = 0

    def __enter__(self):
        with contextlib.ExitStack() as stack:
            _ip("netns", "add", self._name)
            stack.callback(_ip, "netns", "delete", self._name)
            ends = []
            for side in "ab":
                device = f"nl{side}{os.getpid()}"
                ends.append(_tun(device))
                stack.callback(os.close, ends[-1])
                if side == "a":
                    _up(device, HERE, THERE)
                else:
                    _ip("link", "set", device, "netns", self._name)
                    _up(device, THERE, HERE, "-n", self._name)
            _ip("-n", self._name, "link", "set", "lo", "up")
            thread = threading.Thread(target=self._forward, args=ends, daemon=True)
            thread.start()
            stack.callback(thread.join, 5)
            stack.callback(self._is_over.set)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_):
        self._stack.close()

    def _forward(self, a, b):
        other, free_s = {a: b, b: a}, {a: 0.0, b: 0.0}
        waiting, numbers = [], itertools.count()
        while not self._is_over.is_set():
            pause_s = min(0.1, max(0.0, waiting[0][0] - time.monotonic())) if waiting else 0.1
            for end in select.select([a, b], [], [], pause_s)[0]:
                packet, now_s = os.read(end, 65536), time.monotonic()
                begin_s = max(now_s, free_s[end])
                if begin_s - now_s > _QUEUE_S or self._random.random() < self._loss:
                    self.lost += 1
                    continue
                free_s[end] = begin_s + len(packet) / self._bytes_per_s
                heapq.heappush(waiting, (free_s[end] + self._delay_s, next(numbers), other[end], packet))
            while waiting and waiting[0][0] <= time.monotonic():
                _, _, end, packet = heapq.heappop(waiting)
                with contextlib.suppress(OSError):
                    os.write(end, packet)


def _tun(name):
    end = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(end, _TUNSETIFF, struct.pack("16sH", name.encode(), _IFF_TUN | _IFF_NO_PI))
    return end


def _up(device, address, peer, *where):
    _ip(*where, "addr", "add", address, "peer", peer, "dev", device)
    _ip(*where, "link", "set", device, "mtu", str(_MTU), "up")


def _ip(*arguments):
    subprocess.run(["ip", *arguments], check=True)
