"""A running master, as others in the process hold it."""

from __future__ import annotations

import contextlib
import gc
import ipaddress
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from pipros.env import DEFAULT_MASTER_PORT, Environment
from pipros.master.serving import MasterServer
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_server import RpcLimits, connections_that_fit

_DESCRIPTORS: Final = 65536

Network = ipaddress.IPv4Network | ipaddress.IPv6Network


class Master:
    """A ROS master with its parameter server, in a thread of its own.

    Several may run in one process. A context manager: starts on the way in, stops on the way out.

    >>> with Master(port=0) as master:                             # doctest: +SKIP
    ...     print(master.uri)
    http://127.0.0.1:40123/

    Attributes:
        host: the address it listens on; `127.0.0.1` is for this machine only.
    """

    def __init__(
        self,
        *,
        host: str | None = None,
        port: int = DEFAULT_MASTER_PORT,
        advertised_host: str | None = None,
        environment: Environment | None = None,
        allow: Sequence[str] = (),
        parameters: Mapping[str, Any] | None = None,
        limits: RpcLimits | None = None,
        notice_timeout_s: float | None = None,
        store: Path | None = None,
        on_shutdown: Callable[[str], None] | None = None,
    ) -> None:
        """Nothing is opened yet.

        Args:
            host: the address to listen on; by default what the environment says, which is loopback
                as long as everything is local (see `pipros.net.address`).
            port: the port; 0 is a free one.
            advertised_host: the host in `uri`; by default what the environment says.
            environment: by default that of this process.
            allow: networks that may connect, besides loopback: `10.0.0.0/8`, `192.168.1.7`. Empty allows all.
            parameters: keys and values to set before anybody can ask.
            limits: what one peer may cost.
            notice_timeout_s: how long a node may take over a `publisherUpdate` and the like.
            store: a file to keep parameters and registrations in, and to begin with what is in it.
            on_shutdown: called, in the master's thread, when a peer on this machine asks for the end by
                the `shutdown` method; the owner then calls `stop()`.

        Raises:
            ValueError: when `allow` has something that is no network.
        """
        environment = environment or Environment.from_os()
        self.host = host or address.bind_host(environment)
        self._hosts = [self.host]
        if self.host == address.LOOPBACK_IPV6 and not (host or environment.hostname or environment.ip):
            self._hosts.append(address.LOOPBACK)  # whatever the localhost of ROS_MASTER_URI means here
        self._networks: list[Network] = [ipaddress.ip_network(network, strict=False) for network in allow]
        self._loop = BackgroundLoop("master")
        self._server = MasterServer(
            hosts=self._hosts,
            port=port,
            advertised_host=advertised_host or _advertised_host(host, environment),
            admits=self._admits if self._networks else None,
            parameters=parameters or {},
            limits=limits,
            notice_timeout_s=notice_timeout_s,
            store=store,
            on_shutdown=on_shutdown,
        )
        self._is_running = False

    @property
    def port(self) -> int:
        """The port; valid from `start()` on when it was given as 0."""
        return self._server.rpc.port

    @property
    def uri(self) -> str:
        """What nodes set as `ROS_MASTER_URI`; valid from `start()` on."""
        return self._server.uri

    @property
    def binding(self) -> str:
        """Who can connect, in words: `listens on 127.0.0.1, for this computer only`."""
        listens = f"listens on {' and '.join(self._hosts)}"
        if address.is_loopback(self.host):
            return f"{listens}, for this computer only"
        if self._networks:
            return f"{listens}, open to {', '.join(map(str, self._networks))}"
        return f"{listens}, open to everybody who can reach this computer"

    def start(self) -> None:
        """Opens the port; the master answers when this returns.

        Raises:
            OSError: when the port is taken, the address is not of this machine or the store cannot be made.
        """
        self._loop.start()
        try:
            self._loop.run(self._server.start())
        except BaseException:
            self._loop.stop()
            raise
        self._is_running = True

    def stop(self) -> None:
        """Closes the port and all connections. Harmless when repeated."""
        if not self._is_running:
            return
        self._is_running = False
        self._loop.run(self._server.stop())
        self._loop.stop()

    def __enter__(self) -> Master:
        if not self._is_running:
            self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _admits(self, peer: str) -> bool:
        try:
            ip = ipaddress.ip_address(peer)
        except ValueError:
            return False
        return ip.is_loopback or any(ip in network for network in self._networks)


def devote_process() -> None:
    """Fits the process out to be a master before all else. For commands, not for libraries.

    As many descriptors as it may have, because a robot has many nodes. Threads that take turns more
    quickly, so that a large value that is decoded in one does not slow the answers to others. And a
    garbage collector that does not stop everything to look through that value: a master makes no
    reference cycles but those of connections, which are found while they are young. (It takes 10 ms to look
    through 100,000 objects; ten thousand connections that come and go are 127 ms of garbage in one go.)
    """
    sys.setswitchinterval(0.0005)
    gc.set_threshold(2_000, 10, 10_000)
    try:
        import resource
    except ImportError:  # Windows, where sockets do not count as files
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _DESCRIPTORS if hard == resource.RLIM_INFINITY else min(hard, _DESCRIPTORS)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    _make_room_for_descriptors(min(wanted, connections_that_fit() * 2))


def _make_room_for_descriptors(count: int) -> None:
    """Lets the system's table of our descriptors grow to its size now.

    It doubles when it is full, and on Linux a process that has threads stands still for 10 to 20 ms at that.
    """
    import fcntl

    with contextlib.suppress(OSError), open(os.devnull, "rb") as any_file:
        os.close(fcntl.fcntl(any_file.fileno(), fcntl.F_DUPFD_CLOEXEC, count - 1))


def _advertised_host(host: str | None, environment: Environment) -> str:
    if host is None or host in (address.ANY, address.ANY_IPV6):
        if host and not (environment.hostname or environment.ip) and address.is_master_local(environment):
            return address.own_name(environment)
        return address.advertised_host(environment)
    return host
