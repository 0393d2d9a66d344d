"""The parts of a node that exist only while it runs: its ports, and its registrations with the master."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from typing import Any

from pipros.basics.limits import Limits
from pipros.basics.ports import AdvertisedAddress, PortRange
from pipros.net import address
from pipros.net.connection_table import ConnectionTable
from pipros.net.local_stream import name_of
from pipros.net.loop import BackgroundLoop
from pipros.net.master_client import MasterClient
from pipros.net.rpc_server import RpcServer
from pipros.net.sockets import connections_that_fit
from pipros.net.tcpros import TcprosServer
from pipros.node.endpoints import Endpoints
from pipros.node.registration import Registrations
from pipros.node.slave import on_bad_arity
from pipros.node.timings import NodeTimings

SHUTDOWN_DEADLINE_S = 2.0
"""How long shutdown waits for the event loop to close everything."""
RPC_SHARE = 0.125
"""Share of the process's file descriptors that slave API connections can use."""


class RunningNode:
    """The servers of a started node, and the objects that depend on their ports.

    Attributes:
        uri: the URI of the slave API.
        registrations: the node's registrations with the master.
        endpoints: the node's topics and services.
    """

    uri: str
    registrations: Registrations
    endpoints: Endpoints

    def __init__(
        self, name: str, master: MasterClient, loop: BackgroundLoop, log: logging.Logger, timings: NodeTimings
    ) -> None:
        """Store the settings; `open` opens the ports."""
        self._timings = timings
        self._name = name
        self._master = master
        self._loop = loop
        self._log = log
        self._rpc: RpcServer
        self._tcpros: TcprosServer

    async def open(
        self,
        methods: Mapping[str, Callable[..., Any]],
        *,
        advertised: AdvertisedAddress,
        bind_host: str,
        ports: tuple[int | PortRange, int | PortRange] | PortRange,
        limits: Limits,
    ) -> None:
        """Open the node's ports. Runs in the event loop.

        No request is answered before this function returns.

        Args:
            methods: the methods of the slave API.
            advertised: the address to which peers connect.
            bind_host: the address to listen on.
            ports: the slave API port and the TCPROS port, where 0 selects a free port; or a range, whose
                first free port is used for both.
            limits: the limits on the resources that peers can use.

        Raises:
            OSError: the address does not belong to this machine, a port is in use, or no port in the range is
                free.
        """
        rpc_connections = limits.rpc_connections or connections_that_fit(RPC_SHARE)
        is_shared = not isinstance(ports, tuple)
        rpc_port, tcpros_port = ports if isinstance(ports, tuple) else (0, ports)
        self._rpc = RpcServer(
            methods,
            host=() if is_shared else bind_host,
            port=rpc_port,
            limits=limits._replace(rpc_connections=rpc_connections),
            on_bad_arity=on_bad_arity,
        )
        self._tcpros = TcprosServer(
            bind_host,
            tcpros_port,
            on_connection=lambda connection: self.endpoints.attach(connection),
            on_http=self._rpc.adopt if is_shared else None,
            limits=limits,
            log=self._log,
            timings=self._timings.links,
        )
        await self._rpc.start()
        self.uri = address.uri(*advertised.outside(self._tcpros.port if is_shared else self._rpc.port))
        self.registrations = Registrations(
            self._master, self._name, self.uri, self._log, unregister_s=self._timings.unregister_s
        )
        self.endpoints = Endpoints(
            self._name,
            port=self._tcpros.port,
            advertised=advertised,
            loop=self._loop,
            registrations=self.registrations,
            log=self._log,
            limits=limits,
            connections=self._tcpros.connections,
            timings=self._timings,
        )
        self.endpoints.local_name = self._tcpros.listen_locally(name_of(self.endpoints.service_uri))
        self._tcpros.start()

    @property
    def connections(self) -> ConnectionTable:
        """The TCPROS connections that peers have opened."""
        return self._tcpros.connections

    @property
    def descriptors(self) -> list[int]:
        """The file descriptors of the ports, which a forked child must close."""
        return [*self._tcpros.descriptors, *self._rpc.descriptors]

    def leave(self) -> None:
        """Unregister from the master, close all links and ports, then wait briefly for callbacks. Blocks."""
        self.registrations.close()
        links = [peer.link for each in self.endpoints.subscriptions for peer in each.links]
        self.endpoints.close()
        try:
            self._loop.run(self._close(), SHUTDOWN_DEADLINE_S)
        except (TimeoutError, asyncio.TimeoutError):
            self._log.debug("%s did not close its ports in time", self._name)
        end = time.monotonic() + self._timings.callback_grace_s
        for link in links:
            link.join(max(end - time.monotonic(), 0.0))

    async def _close(self) -> None:
        self._tcpros.stop()
        await self._rpc.stop()
