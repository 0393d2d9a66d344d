"""A slow link on one machine: a network namespace behind two TUN devices, with delay and packet loss.

Needs root. A thread forwards packets between the devices, because not every kernel has netem. Like a modem's
link, each direction has its own bandwidth and queue. Packets that arrive at a full queue are also lost.
"""

from __future__ import annotations

import contextlib
import fcntl
import heapq
import itertools
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time

from tests.support.network import changing_interfaces

HERE, THERE = "10.213.7.1", "10.213.7.2"
_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x400454CA, 1, 0x1000
_QUEUE_S = 0.2
_MTU = 1400
_IP = shutil.which("ip") or "ip"  # tests change PATH


class NarrowLink:
    """A network namespace at the other end of a link; a context manager.

    Attributes:
        prefix: beginning of command lines for programs in the namespace. `HERE` is the address of this side.
        lost: number of lost packets.
    """

    def __init__(self, kbit: float, delay_s: float, loss: float) -> None:
        """Store the bandwidth, the delay each way, and the share of packets that are lost."""
        self._bytes_per_s = kbit * 1000 / 8
        self._delay_s, self._loss = delay_s, loss
        self._random = random.Random(1)  # noqa: S311
        self._name = f"narrow{os.getpid()}"
        self._stack = contextlib.ExitStack()
        self._is_over = threading.Event()
        self.prefix = [_IP, "netns", "exec", self._name]
        self.lost = 0

    def __enter__(self) -> NarrowLink:
        with contextlib.ExitStack() as stack, changing_interfaces():
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

    def __exit__(self, *_: object) -> None:
        with changing_interfaces():
            self._stack.close()

    def _forward(self, a: int, b: int) -> None:
        other, free_s = {a: b, b: a}, {a: 0.0, b: 0.0}
        waiting: list[tuple[float, int, int, bytes]] = []
        numbers = itertools.count()
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


def _tun(name: str) -> int:
    end = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(end, _TUNSETIFF, struct.pack("16sH", name.encode(), _IFF_TUN | _IFF_NO_PI))
    return end


def _up(device: str, address: str, peer: str, *where: str) -> None:
    # An IPv6 address would be added a second or two later. The command fails if there is no IPv6.
    without_ipv6 = (_IP, *where, "link", "set", device, "addrgenmode", "none")
    subprocess.run(without_ipv6, capture_output=True, check=False)
    _ip(*where, "addr", "add", address, "peer", peer, "dev", device)
    _ip(*where, "link", "set", device, "mtu", str(_MTU), "up")


def _ip(*arguments: str) -> None:
    subprocess.run([_IP, *arguments], check=True)
