"""Detect registered nodes that have ended.

Theory of operation: every node is probed (queried for its process id) regularly, and at once if a notice
could not be delivered to it. There are three results:
- it responds: it is alive, and its process id is stored;
- the connection is refused, or a different process responds although the node has not registered anything
  since: the node is a suspect and is probed again. After `CONFIRMATIONS` further such results in a row, it
  is considered to have ended;
- it does not respond in time, or there is no route to its host: it stays registered and is listed as
  unreachable. A node that hangs, is being debugged or has temporarily lost its network is not removed.

A node that has never responded is not removed either, but is listed as unreachable. It may run in a
container, with an address that is valid only there, and other nodes may still be able to reach it.

Nodes of pipros ask regularly whether they are registered, over a connection that stays open. A node that has
responded once, and keeps asking, is rarely probed: answering a probe, over a new connection, costs a node as
much as several small messages. When its connection closes, it is probed at once.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine
from enum import Enum
from typing import Any, Final

from pipros.basics.errors import PiprosError, ProtocolError, Unreachable
from pipros.master.options import Probing
from pipros.master.registry import MASTER_ID, Registry
from pipros.net.address import split_uri
from pipros.net.identify import identification, value_of
from pipros.net.rpc_async_client import call_async
from pipros.net.this_machine import ThisMachineCaller, is_this_machine
from pipros.wire.xmlrpc import Fault

_log = logging.getLogger("rosmaster.master")

PROBES_PER_S: Final = 100
CONFIRMATIONS: Final = 3
TRUSTED_ROUNDS: Final = 10
"""In each tenth round, nodes that keep asking are probed, too: any peer can ask in the name of a node."""
PROBES_AT_A_TIME: Final = 20
SLOW_S: Final = 0.1
"""After this time, a probe no longer counts towards `PROBES_AT_A_TIME`."""


Ask = Callable[[str, str, float], Awaitable[Any]]
"""Function that calls an API method with a timeout and returns the response's value; see `ask_node`."""


class ProbeResult(Enum):
    """The result of a probe."""

    THERE = "there"
    REFUSED = "refused"
    REPLACED = "replaced"
    SILENT = "silent"


class Liveness:
    """Probes and identifies nodes on the event loop on which `start` is called.

    Attributes:
        own_port: the port of this master, which must not call itself.
    """

    def __init__(
        self,
        registry: Registry,
        on_gone: Callable[[str, str], None],
        probing: Probing | None = None,
        *,
        ask: Ask | None = None,
    ) -> None:
        """Store the settings; `start` begins probing.

        Args:
            on_gone: called with the name and API of each node that has ended.
            probing: the intervals and timeouts; by default, those of `Probing()`.
            ask: defaults to `ask_node`; tests replace it.
        """
        self._registry = registry
        self._on_gone = on_gone
        self._probing = probing or Probing()
        self._ask = ask or ask_node
        self._pids: dict[tuple[str, str], tuple[int, int]] = {}
        self._probed: set[tuple[str, str]] = set()
        self._met: set[tuple[str, str]] = set()
        self._unreachable: set[str] = set()
        self._suspects: set[str] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._slots = _ProbeSlots(PROBES_AT_A_TIME)
        self._identified: set[tuple[str, str]] = set()
        self._asking: dict[ThisMachineCaller, tuple[str, str, float]] = {}
        self._is_stopped = False
        self.own_port = 0

    @property
    def unreachable(self) -> list[str]:
        """The registered nodes that could not be reached, sorted by name."""
        return sorted(name for name in self._unreachable if name in self._registry.nodes)

    @property
    def met_count(self) -> int:
        """The number of nodes that have responded at least once."""
        return sum(self._is_current(*key) for key in self._met)

    @property
    def suspects(self) -> frozenset[str]:
        """The nodes that are being probed repeatedly to confirm that they have ended."""
        return frozenset(self._suspects)

    def start(self) -> None:
        self._spawn(self._probe_in_rounds())

    def stop(self) -> None:
        """Stop all probes permanently."""
        self._is_stopped = True
        for task in self._tasks:
            task.cancel()

    def suspect(self, node: str) -> None:
        """Probe a node now, because a notice could not be delivered to it."""
        if node not in self._suspects and node in self._registry.nodes and not self._is_stopped:
            self._suspects.add(node)
            self._spawn(self._probe_until_certain(node))

    def note_reached(self, node: str) -> None:
        """Record that the node has responded to a call."""
        self._unreachable.discard(node)
        api = self._registry.api_of(node)
        if api is not None:
            self._met.add((node, api))

    def note_asking(self, node: str, api: str, connection: ThisMachineCaller) -> None:
        """Record that the node has asked whether it is registered."""
        self._asking[connection] = node, api, asyncio.get_running_loop().time()

    def note_lost(self, connection: ThisMachineCaller) -> None:
        """Probe the node that asked over a connection which has closed, if any."""
        if connection in self._asking:
            self.suspect(self._asking.pop(connection)[0])

    async def is_at(self, node: str, api: str) -> bool:
        """Return whether `api` still belongs to the node with the given name, as far as can be determined.

        Return False if no server responds at the URI, if the URI now belongs to another registered node, or
        if the server there is not this node (see `identification`) or has another process id.
        """
        if any(entry.api == api and entry.name != node for entry in self._registry.nodes.values()):
            return False
        try:
            is_node = await self._identify(node, api, self._probing.answer_s)
        except PiprosError:
            return False
        return is_node and await self._probe(node, api) is ProbeResult.THERE

    async def is_node(self, node: str, api: str, timeout_s: float) -> bool:
        """Return whether the server at `api` is the node. A node is identified once for each address.

        Raises:
            PiprosError: the server did not respond, or its responses are invalid.
        """
        if (node, api) not in self._identified and await self._identify(node, api, timeout_s):
            self._identified.add((node, api))
        return (node, api) in self._identified

    async def _identify(self, node: str, api: str, timeout_s: float) -> bool:
        queries = identification(node)
        method = next(queries)
        while True:
            try:
                value = await self._call(api, method, timeout_s)
            except Fault:
                value = None
            try:
                method = queries.send(value)
            except StopIteration as end:
                return bool(end.value)

    async def _call(self, api: str, method: str, timeout_s: float) -> Any:
        if await self._is_own(api):
            raise ProtocolError(f"{api} is the address of this master")
        return await self._ask(api, method, timeout_s)

    async def _is_own(self, api: str) -> bool:
        try:
            host, port, _ = split_uri(api)
        except ValueError:  # the call reports the error
            return False
        return port == self.own_port and await asyncio.to_thread(is_this_machine, host)

    def _spawn(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(coroutine)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _probe_in_rounds(self) -> None:
        loop = asyncio.get_running_loop()
        next_round = loop.time()
        rounds = 0
        while True:
            await asyncio.sleep(self._probing.newcomers_s)
            if loop.time() >= next_round:
                next_round = loop.time() + max(
                    self._probing.round_s, len(self._registry.nodes) / PROBES_PER_S
                )
                rounds += 1
                self._forget_the_gone()
                self._probed.clear()
            nodes = {(entry.name, entry.api) for entry in self._registry.nodes.values()} - self._probed
            self._probed |= nodes
            trusted = self._known_alive(loop.time()) if rounds % TRUSTED_ROUNDS else set()
            for node, api in nodes - trusted:
                if node not in self._suspects and self._is_current(node, api):
                    self._spawn(self._probe_once(node, api, await self._slots.acquire()))

    def _known_alive(self, now: float) -> set[tuple[str, str]]:
        """Return the nodes that have responded, and asked during the last two rounds."""
        since = now - 2 * self._probing.round_s
        self._asking = {each: asked for each, asked in self._asking.items() if asked[2] >= since}
        asking = {(node, api) for node, api, _ in self._asking.values()}
        return {key for key in asking & self._met if key[0] not in self._unreachable}

    def _forget_the_gone(self) -> None:
        self._pids = {key: pid for key, pid in self._pids.items() if self._is_current(*key)}
        self._met = {key for key in self._met if self._is_current(*key)}
        self._identified = {key for key in self._identified if self._is_current(*key)}
        self._unreachable &= set(self._registry.nodes)

    async def _probe_once(self, node: str, api: str, release: Callable[[], None]) -> None:
        result = await self._probe(node, api)
        release()
        if result in (ProbeResult.REFUSED, ProbeResult.REPLACED):
            self.suspect(node)

    async def _probe_until_certain(self, node: str) -> None:
        try:
            api = self._registry.api_of(node)
            for count in range(CONFIRMATIONS):
                if count:
                    await asyncio.sleep(self._probing.confirmation_pause_s)
                if api is None or not self._is_current(node, api):
                    return
                release = await self._slots.acquire()
                result = await self._probe(node, api)
                release()
                if result in (ProbeResult.THERE, ProbeResult.SILENT):
                    return
            if (node, api) not in self._met:
                self._unreachable.add(node)
            elif api and self._is_current(node, api):
                _log.info("%s at %s has ended without unregistering (%s)", node, api, result.value)
                self._on_gone(node, api)
        finally:
            self._suspects.discard(node)

    def _is_current(self, node: str, api: str) -> bool:
        return self._registry.api_of(node) == api

    async def _probe(self, node: str, api: str) -> ProbeResult:
        try:
            pid = await self._call(api, "getPid", self._probing.answer_s)
        except Unreachable as error:
            if isinstance(error.__cause__, ConnectionRefusedError):
                return ProbeResult.REFUSED
            self._unreachable.add(node)
            return ProbeResult.SILENT
        except Fault:
            self._met.add((node, api))
            return ProbeResult.THERE  # the node lacks this method
        except PiprosError:
            return ProbeResult.REPLACED  # the server at this URI is not a ROS node
        self._unreachable.discard(node)
        self._met.add((node, api))
        if type(pid) is not int or pid <= 0:
            return ProbeResult.THERE
        entry = self._registry.nodes.get(node)
        count = entry.registration_count if entry else 0
        known_pid, known_count = self._pids.get((node, api), (pid, count))
        if pid != known_pid and count == known_count:
            return ProbeResult.REPLACED
        self._pids[node, api] = (
            pid,
            count,
        )  # a new id is accepted if the restarted node has registered again
        return ProbeResult.THERE


class _ProbeSlots:
    """Limits the number of concurrent probes, so that the master can still handle calls.

    A slot is held for at most `SLOW_S`, so that unresponsive nodes do not delay the probes of other
    nodes.
    """

    def __init__(self, count: int) -> None:
        self._free = asyncio.Semaphore(count)

    async def acquire(self) -> Callable[[], None]:
        """Wait for a free slot; return the function that releases it, which may be called repeatedly."""
        await self._free.acquire()
        is_held = True

        def release() -> None:
            nonlocal is_held
            if is_held:
                is_held = False
                self._free.release()

        asyncio.get_running_loop().call_later(SLOW_S, release)
        return release


async def ask_node(api: str, method: str, timeout_s: float) -> Any:
    """Call a method without arguments. Return the value, or None if the response is not `[1, text, value]`.

    Raises:
        Unreachable, ProtocolError, Fault: as in `call_async`.
    """
    try:
        answer = await call_async(api, method, MASTER_ID, timeout_s=timeout_s)
    except ValueError as error:
        raise Unreachable(api, str(error)) from None
    return value_of(answer)


async def find_live_nodes(nodes: dict[str, str], timeout_s: float, *, ask: Ask = ask_node) -> dict[str, bool]:
    """Return the names of the nodes to keep from the master's previous run, and whether each responded.

    `nodes` maps the names of all nodes of that run to their API URIs.

    Nodes that report another name, violate the protocol or refuse the connection are omitted. All others are
    kept, including nodes that time out or cannot be reached for another reason.
    """
    slots = asyncio.Semaphore(PROBES_AT_A_TIME * 5)

    async def responds(node: str, api: str) -> bool | None:
        async with slots:
            try:
                name = await asyncio.wait_for(ask(api, "getName", timeout_s), timeout_s)
            except Fault:
                return True
            except asyncio.TimeoutError:
                return False
            except Unreachable as error:
                return None if isinstance(error.__cause__, ConnectionRefusedError) else False
            except PiprosError:
                return None
            return True if not isinstance(name, str) or not name or name == node else None

    found = await asyncio.gather(*(responds(node, api) for node, api in nodes.items()))
    return {node: responded for node, responded in zip(nodes, found, strict=True) if responded is not None}
