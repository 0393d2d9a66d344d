"""A running master: the registry and the parameters, answered for over XML-RPC."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pipros.env import DEFAULT_MASTER_PORT, Environment
from pipros.errors import PiprosError
from pipros.master.api import MasterApi
from pipros.master.notifier import Notifier
from pipros.master.params import ParamTree
from pipros.master.registry import Notice, Registry
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_server import RpcLimits, RpcServer, caller_address

_log = logging.getLogger("rosmaster.master")


class Master:
    """A ROS master with its parameter server, in a thread of its own.

    Several may run in one process. A context manager: starts on the way in, stops on the way out.

    >>> with Master(port=0) as master:                             # doctest: +SKIP
    ...     print(master.uri)
    http://127.0.0.1:40123/
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
            on_shutdown: called, in the master's thread, when a peer on this machine asks for the end by the
                `shutdown` method; the owner then calls `stop()`.

        Raises:
            ValueError: when `allow` has something that is no network.
        """
        environment = environment or Environment.from_os()
        self.host = host or address.bind_host(environment)
        self._advertised = (
            advertised_host
            or (self.host if host and host not in (address.ANY, address.ANY_IPV6) else None)
            or address.advertised_host(environment)
        )
        networks = [ipaddress.ip_network(network, strict=False) for network in allow]
        self._on_shutdown = on_shutdown
        self._registry = Registry()
        self._params = ParamTree()
        self._loop = BackgroundLoop("master")
        self._notifier = Notifier(
            is_current=lambda notice: self._registry.api_of(notice.node) == notice.api,
            may_shut_down=self._may_shut_down,
            reached=self._notice_answered,
            failed=self._notice_failed,
        )
        self._api = MasterApi(
            self._registry, self._params, notify=self._notifier.notify, shutdown=self._shutdown_asked
        )
        for key, value in (parameters or {}).items():
            self._params.set(key, value)
        self._rpc = RpcServer(
            self._api.methods,
            host=self.host,
            port=port,
            limits=limits,
            admits=(lambda peer: _is_in(peer, networks)) if networks else None,
        )
        self._is_running = False

    @property
    def port(self) -> int:
        return self._rpc.port

    @property
    def uri(self) -> str:
        """What nodes set as `ROS_MASTER_URI`; valid from `start()` on."""
        return self._api.uri

    def start(self) -> None:
        """Opens the port; the master answers when this returns.

        Raises:
            OSError: when the port is taken or the address is not of this machine.
        """
        self._loop.start()
        try:
            self._loop.run(self._rpc.start())
        except BaseException:
            self._loop.stop()
            raise
        self._api.uri = address.uri(self._advertised, self._rpc.port)
        self._is_running = True

    def stop(self) -> None:
        """Closes the port and all connections. Harmless when repeated."""
        if not self._is_running:
            return
        self._is_running = False
        self._loop.run(self._stop())
        self._loop.stop()

    def __enter__(self) -> Master:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    async def _stop(self) -> None:
        self._notifier.close()
        await self._rpc.stop()

    def _shutdown_asked(self, reason: str) -> bool:
        if not address.is_loopback(caller_address.get()) or not self._on_shutdown:
            return False
        asyncio.get_running_loop().call_later(0.05, self._on_shutdown, reason)  # after the answer is out
        return True

    async def _may_shut_down(self, notice: Notice) -> bool:
        _log.info("%s at %s: %s", notice.node, notice.api, notice.params[1])
        return True

    def _notice_answered(self, notice: Notice) -> None:
        _log.debug("%s of %s delivered", notice.method, notice.node)

    def _notice_failed(self, notice: Notice, error: PiprosError) -> None:
        _log.debug("%s of %s not delivered: %s", notice.method, notice.node, error)


def _is_in(peer: str, networks: Sequence[ipaddress.IPv4Network | ipaddress.IPv6Network]) -> bool:
    try:
        ip = ipaddress.ip_address(peer)
    except ValueError:
        return False
    mapped = getattr(ip, "ipv4_mapped", None)
    ip = mapped or ip
    return ip.is_loopback or any(ip in network for network in networks)
