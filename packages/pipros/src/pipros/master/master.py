"""A master as an object that runs in its own thread."""

from __future__ import annotations

import contextlib
import gc
import ipaddress
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from pipros.basics.env import Environment, InvalidEnvironment, split_master_uri
from pipros.basics.ports import AdvertisedAddress
from pipros.basics.posix import make_room_for_descriptors, raise_descriptor_limit
from pipros.master.options import MasterOptions
from pipros.master.server import MasterServer
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.sockets import connections_that_fit
from pipros.net.this_machine import ThisMachineCaller, addresses_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from pipros.master.options import MasterSettings


_DESCRIPTORS: Final = 65536


class Master:
    """A ROS master with its parameter server, in its own thread.

    Several masters can run in one process. Used as a context manager, a master starts on entry and stops on
    exit.

    Examples:
        >>> with Master(port=0) as master:  # doctest: +SKIP
        ...     print(master.uri)
        http://127.0.0.1:40123/

    Attributes:
        host: the address that the master listens on; `127.0.0.1` is reachable only from this machine.
    """

    def __init__(
        self,
        options: MasterOptions | None = None,
        *,
        environment: Environment | None = None,
        **settings: Unpack[MasterSettings],
    ) -> None:
        """Store the settings; `start` opens the port.

        Args:
            options: all settings in one object.
            environment: defaults to `os.environ`.
            settings: fields of `MasterOptions`, which override the fields of `options`.

        Raises:
            ValueError: an entry of `allow` is not a network.
            InvalidEnvironment: `PIPROS_ADVERTISE` or `PIPROS_PORTS` has an invalid value.
        """
        options = replace(options or MasterOptions(), **settings)
        environment = environment or Environment.from_os()
        host = options.host
        self.host = host or address.bind_host(environment)
        self._hosts = [self.host]
        if self.host == address.LOOPBACK_IPV6 and not (host or environment.hostname or environment.ip):
            self._hosts.append(address.LOOPBACK)  # `localhost` in ROS_MASTER_URI may mean either IPv4 or IPv6
        elif not host and address.is_loopback(self.host):
            self._hosts = list(
                dict.fromkeys([self.host, *_loopback_addresses(environment, options.known_as)])
            )
        self._allowed = AllowedNetworks(options.allow) if options.allow else None
        self._loop = BackgroundLoop("master")
        self._server = MasterServer(
            options,
            hosts=self._hosts,
            advertised=_advertised(options, environment),
            admits=self._allowed.admits if self._allowed else None,
        )
        self._is_running = False

    @property
    def port(self) -> int:
        """The port. If 0 was requested, the actual port is available after `start()`."""
        return self._server.rpc.port

    @property
    def uri(self) -> str:
        """The `ROS_MASTER_URI` for nodes; valid after `start()`."""
        return self._server.uri

    @property
    def binding(self) -> str:
        """A description of who can connect, such as `listens on 127.0.0.1, for this computer only`."""
        listens = f"listens on {' and '.join(self._hosts)}"
        if address.is_loopback(self.host):
            return f"{listens}, for this computer only"
        if self._allowed:
            return f"{listens}, open to {self._allowed}"
        return f"{listens}, open to all programs that can reach this computer"

    def start(self) -> None:
        """Open the port. The master accepts calls by the time this method returns.

        Raises:
            OSError: the port is in use, or the address does not belong to this machine.
            StoreUntrusted: another user could have written to the store.
        """
        self._loop.start()
        try:
            self._loop.run(self._server.start())
        except BaseException:
            self._loop.stop()
            raise
        self._is_running = True

    def stop(self) -> None:
        """Close the port and all connections. May be called repeatedly."""
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


def _loopback_addresses(environment: Environment, known_as: Sequence[str]) -> Iterator[str]:
    """Yield the IPv4 loopback addresses of the master URI's host and of the hosts in `known_as`."""
    hosts = list(known_as)
    with contextlib.suppress(InvalidEnvironment):
        hosts.insert(0, split_master_uri(environment.master_uri)[0])
    for host in hosts:
        if host == "localhost":
            yield address.LOOPBACK
        else:
            yield from (found for found in addresses_of(host) if found.startswith("127."))


def tune_for_master() -> None:
    """Tune process-wide settings for a dedicated master. Call this only from commands, not from libraries.

    - The descriptor limit is raised to 65,536, or as far as possible, because a robot has many nodes.
    - Threads switch more often, so that decoding a large value in one thread does not delay responses from
      others.
    - The garbage collector rarely makes a full pass, because a full pass over 100,000 objects takes 10 ms. A
      master creates reference cycles only in connections, and these are collected while they are young.
      (Collecting ten thousand short-lived connections at once would take 127 ms.)
    """
    sys.setswitchinterval(0.0005)
    gc.set_threshold(2_000, 10, 10_000)
    raise_descriptor_limit(_DESCRIPTORS)
    make_room_for_descriptors(connections_that_fit() * 2)


def _advertised(options: MasterOptions, environment: Environment) -> AdvertisedAddress:
    if options.advertised_host:
        return AdvertisedAddress(options.advertised_host)
    if environment.advertise:
        return address.advertised_address(environment)
    host = options.host
    if host and host not in (address.ANY, address.ANY_IPV6):
        return AdvertisedAddress(host)
    if host and not (environment.hostname or environment.ip) and address.is_master_local(environment):
        return AdvertisedAddress(address.own_name(environment))
    return AdvertisedAddress(address.advertised_host(environment))


class AllowedNetworks:
    """The networks from which callers may connect. Callers on this machine may always connect.

    >>> allowed = AllowedNetworks(["10.0.0.0/8", "192.168.1.7"])
    >>> str(allowed)
    '10.0.0.0/8, 192.168.1.7/32'
    """

    def __init__(self, networks: Sequence[str]) -> None:
        """Parse the networks. Raises ValueError if one is invalid."""
        self._networks = [_network(network) for network in networks]

    def admits(self, caller: ThisMachineCaller) -> bool:
        """Return whether a caller is in one of the networks, or on this machine."""
        try:
            ip = ipaddress.ip_address(caller.host)
        except ValueError:
            return False
        return any(ip in network for network in self._networks) or caller.is_here

    def __str__(self) -> str:
        return ", ".join(map(str, self._networks))


def _network(text: str) -> ipaddress.IPv4Network | ipaddress.IPv6Network:
    try:
        return ipaddress.ip_network(text, strict=False)
    except ValueError:
        raise ValueError(f"an allowed network must be like 10.0.0.0/8 or 10.0.0.7, got [{text}]") from None
