"""Separate networks on this machine, made of Linux network namespaces."""

import contextlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pytest

if sys.platform != "win32":
    import fcntl


def is_available() -> bool:
    """Return whether namespaces can be created: on Linux, as root, with the `ip` command."""
    if sys.platform != "linux" or os.geteuid() != 0 or shutil.which("ip") is None:
        return False
    name = f"pipros-try-{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, check=False)
    subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)
    return made.returncode == 0


needs_network = pytest.mark.skipif(not is_available(), reason="needs network namespaces, which need root")


NOTICED_AFTER_S = 3.0
"""The longest time that Chromium takes to act on a change of network interfaces, with a margin."""


@contextlib.contextmanager
def steady_interfaces() -> Iterator[None]:
    """Within the block, keep other tests from adding or removing network interfaces of this machine.

    Chromium aborts its requests with ERR_NETWORK_CHANGED if an interface changes. It does so with a delay, so
    the block begins when the last change is old enough.
    """
    with _interfaces_locked(fcntl.LOCK_SH) as changed_s:
        time.sleep(max(0.0, changed_s + NOTICED_AFTER_S - time.time()))
        yield


@contextlib.contextmanager
def changing_interfaces() -> Iterator[None]:
    """Wait until no browser is being tested, for a block that adds or removes interfaces of this machine."""
    with _interfaces_locked(fcntl.LOCK_EX):
        yield


@contextlib.contextmanager
def _interfaces_locked(kind: int) -> Iterator[float]:
    """Hold a lock of a kind of `fcntl.flock`. The value is the time of the last change, as by `time.time`."""
    name = f"{tempfile.gettempdir()}/pipros-test-interfaces-{os.getuid()}"
    with Path(name).open("a") as opened:
        with Path(f"{name}-next").open("a") as turn:  # so that exclusive locks are not starved by shared ones
            fcntl.flock(turn, fcntl.LOCK_EX)
            fcntl.flock(opened, kind)
        try:
            yield os.fstat(opened.fileno()).st_mtime
        finally:
            if kind == fcntl.LOCK_EX:
                os.utime(opened.fileno())


class LoneNetwork:
    """A network that consists of one machine with a test's host names. `command` runs programs in it."""

    def __init__(
        self, hosts: str, nameserver: str = "", addresses: Sequence[str] = (), hostname: str | None = None
    ) -> None:
        """Create the network.

        Args:
            hosts: the content of its `/etc/hosts`.
            nameserver: the address of a name server, which never answers; empty for none.
            addresses: addresses in addition to loopback, such as `10.98.0.1/24`.
            hostname: the name of the machine; defaults to the name of this machine.
        """
        self._prefix: list[str] = []
        if hostname is not None:
            name_it = f'echo {hostname} > /proc/sys/kernel/hostname && exec "$@"'
            self._prefix = [str(shutil.which("unshare")), "--uts", "/bin/sh", "-c", name_it, "sh"]
        self._name = f"pipros-lone-{random.randrange(1 << 32)}"  # noqa: S311 - a free number, not a secret
        self._folder = Path("/etc/netns") / self._name  # `ip netns exec` mounts its files over those in /etc
        self._folder.mkdir(parents=True)
        (self._folder / "hosts").write_text(hosts)
        if nameserver:
            (self._folder / "resolv.conf").write_text(f"nameserver {nameserver}\n")
        try:
            _ip("netns", "add", self._name)
            _ip("-n", self._name, "link", "set", "lo", "up")
            if nameserver:  # packets are dropped without an error
                _ip("-n", self._name, "route", "add", "default", "dev", "lo")
            if addresses:
                _ip("-n", self._name, "link", "add", "lan", "type", "veth", "peer", "name", "wall")
                _ip("-n", self._name, "link", "set", "wall", "up")
                _ip("-n", self._name, "link", "set", "lan", "up")
            for address in addresses:
                _ip("-n", self._name, "address", "add", address, "dev", "lan")
        except BaseException:
            self.close()
            raise

    def command(self, *argv: str) -> list[str]:
        """Return the command line that runs a program in the network."""
        return [str(shutil.which("ip")), "netns", "exec", self._name, *self._prefix, *argv]

    def close(self) -> None:
        subprocess.run(["ip", "netns", "delete", self._name], capture_output=True, check=False)
        shutil.rmtree(self._folder)


class FarNetwork:
    """A network of this machine and another host, connected by a cable that can be cut.

    `command` runs programs on the other host. `near` and `far` are the addresses of the two.
    """

    def __init__(self) -> None:
        number = random.randrange(1 << 16)  # noqa: S311 - a free number, not a secret
        subnet = f"10.213.{number // 256}"
        first = number % 64 * 4
        self.near, self.far = f"{subnet}.{first + 1}", f"{subnet}.{first + 2}"
        self._name, self._cable = f"pipros-{number}", f"pip{number}"
        _ip("netns", "add", self._name)
        try:
            plug = ("type", "veth", "peer", "name", "far0", "netns", self._name)
            with changing_interfaces():
                _ip("link", "add", self._cable, *plug)
                without_ipv6 = ("ip", "link", "set", self._cable, "addrgenmode", "none")
                # An IPv6 address would be added a second or two later. The command fails if there is no IPv6.
                subprocess.run(without_ipv6, capture_output=True, check=False)
                _ip("address", "add", f"{self.near}/30", "dev", self._cable)
                _ip("link", "set", self._cable, "up")
                _ip("-n", self._name, "link", "set", "far0", "up")
            _ip("-n", self._name, "link", "set", "lo", "up")
            self.mend()
        except BaseException:
            self.close()
            raise

    def command(self, *argv: str) -> list[str]:
        """Return the command line that runs a program on the far host."""
        return [str(shutil.which("ip")), "netns", "exec", self._name, *argv]

    def cut(self) -> None:
        """Drop all packets in both directions from now on, without an error on either side."""
        _ip("-n", self._name, "address", "delete", f"{self.far}/30", "dev", "far0")

    def mend(self) -> None:
        _ip("-n", self._name, "address", "add", f"{self.far}/30", "dev", "far0")

    def give_second_address(self) -> str:
        """Add and return a second address of the far host. The host still sends its packets from `far`."""
        address = self.far.replace("10.213.", "10.214.")
        _ip("-n", self._name, "address", "add", f"{address}/32", "dev", "lo")
        _ip("route", "add", f"{address}/32", "via", self.far)
        return address

    def close(self) -> None:
        with changing_interfaces():
            subprocess.run(["ip", "link", "delete", self._cable], capture_output=True, check=False)
        subprocess.run(["ip", "netns", "delete", self._name], capture_output=True, check=False)


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True)


NAT = """
table ip nat {{
  chain inwards {{
    type nat hook prerouting priority -100;
    {rules}
  }}
  chain outwards {{
    type nat hook postrouting priority 100;
    oifname "outer" masquerade
  }}
}}
table ip filter {{
  chain forward {{
    type filter hook forward priority 0; policy drop;
    ct state established,related accept
    iifname "inner" accept
    ct status dnat accept
  }}
}}
"""


class NatNetwork:
    """An open host, and hosts that are each behind a separate router that maps ports, as for containers.

    The hosts behind the routers all have the same private address. From outside, they can only be reached
    through the mapped ports of their routers. A host cannot reach itself through its router.

    Attributes:
        open: the address of the open host.
        mapped: the outer addresses of the routers.
    """

    def __init__(self, mappings: Sequence[Mapping[int, int]]) -> None:
        """Create the network. For each router, `mappings` maps outer ports to ports of the host behind it."""
        number = random.randrange(1 << 16)  # noqa: S311 - a free number, not a secret
        self._names = [f"pipros-nat-{number}-{part}" for part in ("open", *range(len(mappings)))]
        self._routers = [f"pipros-nat-{number}-router{index}" for index in range(len(mappings))]
        self.open = "10.215.0.1"
        self.mapped = [f"10.215.0.{index + 2}" for index in range(len(mappings))]
        try:
            for name in (*self._names, *self._routers):
                _ip("netns", "add", name)
                _ip("-n", name, "link", "set", "lo", "up")
            opened = self._names[0]
            _ip("-n", opened, "link", "add", "lan", "type", "bridge")
            _ip("-n", opened, "address", "add", f"{self.open}/24", "dev", "lan")
            _ip("-n", opened, "link", "set", "lan", "up")
            for index, ports in enumerate(mappings):
                self._add_router(index, ports)
        except BaseException:
            self.close()
            raise

    def command(self, host: int | None, *argv: str) -> list[str]:
        """Return the command line that runs a program on the open host (None) or behind router `host`."""
        name = self._names[0 if host is None else host + 1]
        return [str(shutil.which("ip")), "netns", "exec", name, *argv]

    def map_port(self, router: int, outer: int, inner: int) -> None:
        """Map another outer port of a router to a port of the host behind it."""
        rule = f"iifname outer tcp dport {outer} dnat to 192.168.77.2:{inner}".split()
        run = ("ip", "netns", "exec", self._routers[router])
        subprocess.run([*run, "nft", "add", "rule", "ip", "nat", "inwards", *rule], check=True)

    def close(self) -> None:
        for name in (*self._names, *self._routers):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)

    def _add_router(self, index: int, ports: Mapping[int, int]) -> None:
        opened, inside, router = self._names[0], self._names[index + 1], self._routers[index]
        up = ("type", "veth", "peer", "name", "outer", "netns", router)
        _ip("-n", opened, "link", "add", f"port{index}", *up)
        _ip("-n", opened, "link", "set", f"port{index}", "master", "lan", "up")
        _ip("-n", inside, "link", "add", "lan", "type", "veth", "peer", "name", "inner", "netns", router)
        for name, device, address in (
            (router, "outer", f"{self.mapped[index]}/24"),
            (router, "inner", "192.168.77.1/24"),
            (inside, "lan", "192.168.77.2/24"),
        ):
            _ip("-n", name, "address", "add", address, "dev", device)
            _ip("-n", name, "link", "set", device, "up")
        _ip("-n", inside, "route", "add", "default", "via", "192.168.77.1")
        run = ("ip", "netns", "exec", router)
        forwarding = "echo 1 > /proc/sys/net/ipv4/ip_forward"
        subprocess.run([*run, "sh", "-c", forwarding], check=True, capture_output=True)
        rules = "\n    ".join(
            f'iifname "outer" tcp dport {outer} dnat to 192.168.77.2:{inner}'
            for outer, inner in ports.items()
        )
        text = NAT.format(rules=rules)
        subprocess.run([*run, "nft", "-f", "-"], input=text, text=True, check=True, capture_output=True)
