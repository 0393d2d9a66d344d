"""A proxy between a node and the rest of a ROS system: its master, and its peers.

A node that is started with the proxy's URI as `ROS_MASTER_URI` communicates with all other nodes through the
proxy. Theory of operation: the proxy forwards each XML-RPC call. In parameters and results, it replaces every
address (the node's own address in registrations, addresses of publishers and services in lookups, the TCPROS
port in the result of `requestTopic`) with the address of one of the proxy's ports, and removes offers of Unix
streams. Therefore, each connection leads to the proxy, whichever side opens it. Each port injects the faults
for its kind of connection.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from dataclasses import replace
from typing import Any, Literal, TypeVar, get_args
from urllib.parse import urlsplit

from pipros.net import local_stream
from pipros.net.address import LOOPBACK, uri
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_async_client import call_async
from pipros.net.rpc_server import RpcServer
from pipros.net.this_machine import ThisMachineCaller
from pipros_tools.testing.faults.plan import Faults
from pipros_tools.testing.faults.tcp_proxy import Address, ProxyCounts, Switch, TcpProxy

T = TypeVar("T")

Kind = Literal["master", "nodes", "topics", "services"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""Kinds of connections: XML-RPC to the master, XML-RPC to nodes, topic links, service links."""

_CALL_LIMIT_S = 60.0
"""Time limit for a forwarded call. Genuine nodes wait for their master indefinitely."""

_WAIT_S = 30.0

_LEFT_ALONE = frozenset({"setParam", "getParam", "paramUpdate"})
"""Methods whose values are user data, not addresses."""


class FaultProxy:
    """A proxy between the nodes that are started with its `uri` and all other nodes. Thread-safe.

    Until `inject`, `cut`, `stall` or `refuse` is called, the proxy does not disturb connections. Nodes
    behind the proxy also communicate with each other through it. The proxy listens on the loopback address,
    and supports pipros, rospy and roscpp nodes.

    Attributes:
        uri: the `ROS_MASTER_URI` for nodes behind the proxy; valid after `start`.
    """

    def __init__(self, master_uri: str, *, seed: int = 0) -> None:
        """Store the arguments; `start` opens the port.

        The same seed gives each connection the same faults at the same byte positions.
        """
        self.uri = ""
        self._master_uri = master_uri
        self._seed = seed
        self._loop = BackgroundLoop("fault proxy")
        self._switches: dict[Kind, Switch] = {}
        self._proxies: dict[tuple[Kind, Address], TcpProxy] = {}
        self._proxy_addresses: set[Address] = set()
        self._forwarders: list[_Forwarder] = []
        self._starting = asyncio.Lock()

    def start(self) -> None:
        """Open the port for the master.

        Raises:
            OSError: no port is available.
        """
        self._loop.start()
        self._run(self._open())

    def close(self) -> None:
        """Close all ports and connections. May be called repeatedly."""
        if self._switches:
            self._run(self._shut())
            self._switches = {}
            self._loop.stop()

    def __enter__(self) -> FaultProxy:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- faults ------------------------------------------------------------------

    def inject(self, *kinds: Kind, **faults: Any) -> None:
        """Replace the faults on connections of these kinds (by default `topics`), including open ones.

        The keywords are the attributes of `Faults`: `proxy.inject("topics", "services", delay_s=0.05,
        split_bytes=7)`. Without keywords, no faults are injected.

        Raises:
            TypeError: the fault is unknown.
            ValueError: the kind is unknown, or a value is invalid; see `Faults`.
        """
        wanted = Faults(**faults)

        async def use() -> None:
            for switch in chosen:
                switch.inject(wanted)

        chosen = self._chosen(kinds)
        self._run(use())

    def cut(self, *kinds: Kind, reset: bool = True) -> int:
        """Break all open connections of these kinds (by default `topics`), and return their number.

        New connections are still accepted. If `reset` is false, connections are closed without a reset, as
        if the other process had been killed.
        """

        async def cut() -> int:
            return sum(switch.cut(reset=reset) for switch in chosen)

        chosen = self._chosen(kinds)
        return self._run(cut())

    def stall(self, *kinds: Kind) -> None:
        """Stop forwarding on connections of these kinds (by default `topics`) until `resume` is called."""
        self._stall(kinds, stall=True)

    def resume(self, *kinds: Kind) -> None:
        """Undo `stall` for these kinds (by default `topics`), and forward the bytes that were held back."""
        self._stall(kinds, stall=False)

    def refuse(self, *kinds: Kind, refuse: bool = True) -> None:
        """Reset new connections of these kinds (by default `topics`). `refuse=False` accepts them again."""
        for switch in self._chosen(kinds):
            switch.is_refusing = refuse

    def counts(self, kind: Kind = "topics") -> ProxyCounts:
        """Return a copy of the current counts for connections of one kind."""
        return replace(self._chosen((kind,))[0].counts)

    def _stall(self, kinds: tuple[Kind, ...], *, stall: bool) -> None:
        async def change() -> None:
            for switch in chosen:
                switch.stall(stall=stall)

        chosen = self._chosen(kinds)
        self._run(change())

    def _chosen(self, kinds: tuple[Kind, ...]) -> list[Switch]:
        if unknown := set(kinds) - set(KINDS):
            raise ValueError(f"kind must be one of {', '.join(KINDS)}, got {unknown.pop()}")
        return [self._switches[kind] for kind in kinds or ("topics",)]

    # -- in the event loop ----------------------------------------------------------

    def _run(self, coroutine: Coroutine[Any, Any, T]) -> T:
        return self._loop.run(coroutine, _WAIT_S)

    async def _open(self) -> None:
        self._switches = {kind: Switch() for kind in KINDS}
        self.uri = await self._in_place_of(self._master_uri, "master")

    async def _shut(self) -> None:
        for proxy in self._proxies.values():
            proxy.stop_accepting()
        await asyncio.sleep(0)
        for proxy in self._proxies.values():
            proxy.close()
        for switch in self._switches.values():
            switch.cut()
        for forwarder in self._forwarders:
            await forwarder.stop()

    async def translate(self, value: Any) -> Any:
        """Return a copy of a value in which every address is replaced with that of one of the proxy's ports.

        Offers of Unix streams are removed.
        """
        if isinstance(value, str):
            if value.startswith("http://"):
                return await self._in_place_of(value, "nodes")
            if value.startswith("rosrpc://"):
                return await self._in_place_of(value, "services")
            return value
        if isinstance(value, (list, tuple)):
            if len(value) == 3 and value[0] == "TCPROS" and isinstance(value[2], int):
                return ["TCPROS", *await self._proxy("topics", (value[1], value[2]))]
            return [await self.translate(item) for item in value if not _is_unix_stream(item)]
        return value

    async def _in_place_of(self, text: str, kind: Kind) -> str:
        parts = urlsplit(text)
        try:
            address = (parts.hostname or "", parts.port or 0)
        except ValueError:
            return text  # a node registered an invalid address, which is forwarded unchanged
        if not all(address):
            return text
        return uri(*await self._proxy(kind, address), parts.scheme)

    async def _proxy(self, kind: Kind, address: Address) -> Address:
        """Return the proxy address that forwards to `address`, opening a port on first use."""
        async with self._starting:
            if address in self._proxy_addresses:
                return address
            if (kind, address) not in self._proxies:
                target, alive = address, None
                if kind in ("master", "nodes"):
                    forwarder = _Forwarder(self, uri(*address))
                    await forwarder.start()
                    self._forwarders.append(forwarder)
                    target, alive = (LOOPBACK, forwarder.port), address
                count = sum(known == kind for known, _ in self._proxies)
                seed = f"{self._seed}/{kind}/{count}"
                proxy = TcpProxy(seed, target, self._switches[kind], alive=alive)
                await proxy.start()
                self._proxy_addresses.add(proxy.address)
                self._proxies[kind, address] = proxy
            return self._proxies[kind, address].address


def _is_unix_stream(value: object) -> bool:
    """Return whether a value offers a Unix stream, which would bypass the proxy."""
    return isinstance(value, list) and value[:1] == [local_stream.PROTOCOL]


class _Forwarder(RpcServer):
    """A server that forwards each call to another XML-RPC server."""

    def __init__(self, proxy: FaultProxy, target: str) -> None:
        super().__init__({})
        self._proxy = proxy
        self._target = target

    def call(self, name: str, params: tuple[Any, ...], *, caller: ThisMachineCaller) -> Any:
        if name == "system.multicall":
            # `call` is invoked again for each call in the multicall
            return super().call(name, params, caller=caller)
        return asyncio.ensure_future(self._forward(name, params))

    async def _forward(self, name: str, params: tuple[Any, ...]) -> Any:
        if name in _LEFT_ALONE:
            return await call_async(self._target, name, *params, timeout_s=_CALL_LIMIT_S)
        sent = await self._proxy.translate(list(params))
        answer = await call_async(self._target, name, *sent, timeout_s=_CALL_LIMIT_S)
        return await self._proxy.translate(answer)
