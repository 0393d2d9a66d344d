"""Who of the registered nodes is still there.

Theory of operation: every node is asked for its process id now and then, and at once when a notice
could not be delivered to it. What comes of it decides:

- it answers: it is there, and its process id is remembered;
- the connection is refused, or the answer comes from another process than before, although the
  node has not registered anything since: it is asked again, and when that gave the same
  `CONFIRMATIONS` times in a row, it is gone;
- no answer in time, or no way to its host: it is kept, and shown as unreachable. A node that
  hangs, is being debugged or lost its network for a while is not forgotten for that.

A node that was never met is kept and shown as unreachable whatever comes of asking it: it may be one
in a container whose address means something only there, and others may well reach it.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from enum import Enum
from typing import Any, Final

from pipros.errors import PiprosError, Unreachable
from pipros.master.registry import MASTER_ID, Registry
from pipros.net.rpc_async import call_async
from pipros.wire.xmlrpc import Fault

_log = logging.getLogger("rosmaster.master")

ROUND_S: Final = 3.0
"""How often every node is asked, as long as that makes no more than `ASKED_PER_S` questions."""
ASKED_PER_S: Final = 100
NEWCOMERS_S: Final = 0.3
"""How soon a node is asked for the first time."""
ANSWER_S: Final = 3.0
"""How long a node may take to answer."""
SLOW_S: Final = 0.1
"""After this time without an answer the next node in line is asked."""
CONFIRMATIONS: Final = 3
CONFIRMATION_PAUSE_S: Final = 0.5
ASKED_AT_A_TIME: Final = 20


class Presence(Enum):
    """What asking a node came to."""

    THERE = "there"
    REFUSED = "refused"
    REPLACED = "replaced"
    SILENT = "silent"


class Liveness:
    """Asks nodes, on the loop that it was started on.

    `gone` is called with the name and the API of each node that is found to have gone.
    """

    def __init__(self, registry: Registry, gone: Callable[[str, str], None]) -> None:
        self._registry = registry
        self._gone = gone
        self._pids: dict[tuple[str, str], tuple[int, int]] = {}
        self._asked: set[tuple[str, str]] = set()
        self._met: set[tuple[str, str]] = set()
        self._unreachable: set[str] = set()
        self._suspects: set[str] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._places = _Places(ASKED_AT_A_TIME)
        self._is_stopped = False

    @property
    def unreachable(self) -> list[str]:
        """The nodes that did not answer when they were asked last."""
        return sorted(name for name in self._unreachable if name in self._registry.nodes)

    @property
    def met_count(self) -> int:
        """How many of the nodes have ever answered."""
        return sum(self._is_current(*key) for key in self._met)

    def start(self) -> None:
        self._spawn(self._ask_rounds())

    def stop(self) -> None:
        """Ends all asking, for good."""
        self._is_stopped = True
        for task in self._tasks:
            task.cancel()

    def suspect(self, node: str) -> None:
        """Asks a node now, because something could not be delivered to it."""
        if node not in self._suspects and node in self._registry.nodes and not self._is_stopped:
            self._suspects.add(node)
            self._spawn(self._ask_until_sure(node))

    def note_reached(self, node: str) -> None:
        """The node answered somebody."""
        self._unreachable.discard(node)
        api = self._registry.api_of(node)
        if api is not None:
            self._met.add((node, api))

    async def is_at(self, node: str, api: str) -> bool:
        """True when `api` still belongs to the node of that name, as far as can be found out.

        False when nobody answers there, when another registered node has that API by now, when who answers
        has another name (only Python nodes tell theirs) or another process id than the node had.
        """
        if any(entry.api == api and entry.name != node for entry in self._registry.nodes.values()):
            return False
        try:
            name = await _ask(api, "getName")
        except Fault:
            name = None  # roscpp nodes do not tell
        except PiprosError:
            return False
        if isinstance(name, str) and name:
            return name == node
        return await self._presence(node, api) is Presence.THERE

    def _spawn(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(coroutine)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _ask_rounds(self) -> None:
        loop = asyncio.get_running_loop()
        next_round = loop.time()
        while True:
            await asyncio.sleep(NEWCOMERS_S)
            if loop.time() >= next_round:
                next_round = loop.time() + max(ROUND_S, len(self._registry.nodes) / ASKED_PER_S)
                self._forget_the_gone()
                self._asked.clear()
            nodes = {(entry.name, entry.api) for entry in self._registry.nodes.values()} - self._asked
            self._asked |= nodes
            for node, api in nodes:
                if node not in self._suspects and self._is_current(node, api):
                    self._spawn(self._ask_once(node, api, await self._places.take()))

    def _forget_the_gone(self) -> None:
        self._pids = {key: pid for key, pid in self._pids.items() if self._is_current(*key)}
        self._met = {key for key in self._met if self._is_current(*key)}
        self._unreachable &= set(self._registry.nodes)

    async def _ask_once(self, node: str, api: str, leave_place: Callable[[], None]) -> None:
        presence = await self._presence(node, api)
        leave_place()
        if presence in (Presence.REFUSED, Presence.REPLACED):
            self.suspect(node)

    async def _ask_until_sure(self, node: str) -> None:
        try:
            api = self._registry.api_of(node)
            for count in range(CONFIRMATIONS):
                if count:
                    await asyncio.sleep(CONFIRMATION_PAUSE_S)
                if api is None or not self._is_current(node, api):
                    return
                leave_place = await self._places.take()
                presence = await self._presence(node, api)
                leave_place()
                if presence in (Presence.THERE, Presence.SILENT):
                    return
            if (node, api) not in self._met:
                self._unreachable.add(node)
            elif api and self._is_current(node, api):
                _log.info("%s at %s has gone without a word (%s)", node, api, presence.value)
                self._gone(node, api)
        finally:
            self._suspects.discard(node)

    def _is_current(self, node: str, api: str) -> bool:
        return self._registry.api_of(node) == api

    async def _presence(self, node: str, api: str) -> Presence:
        try:
            pid = await _ask(api, "getPid")
        except Unreachable as error:
            if isinstance(error.__cause__, ConnectionRefusedError):
                return Presence.REFUSED
            self._unreachable.add(node)
            return Presence.SILENT
        except Fault:
            self._met.add((node, api))
            return Presence.THERE  # a node that does not tell its process id
        except PiprosError:
            return Presence.REPLACED  # something that is no ROS node answers there
        self._unreachable.discard(node)
        self._met.add((node, api))
        if type(pid) is not int or pid <= 0:
            return Presence.THERE
        entry = self._registry.nodes.get(node)
        heard = entry.heard if entry else 0
        known_pid, known_heard = self._pids.get((node, api), (pid, heard))
        if pid != known_pid and heard == known_heard:
            return Presence.REPLACED
        self._pids[node, api] = (pid, heard)  # a node that came again to the same port has registered again
        return Presence.THERE


class _Places:
    """How many nodes are asked at a time, so that calls are answered meanwhile.

    A place is kept for `SLOW_S` at most: silent nodes do not keep others from being asked.
    """

    def __init__(self, count: int) -> None:
        self._free = asyncio.Semaphore(count)

    async def take(self) -> Callable[[], None]:
        """Waits for a free place. Returns what gives it back; that may be called twice."""
        await self._free.acquire()
        is_taken = True

        def give_back() -> None:
            nonlocal is_taken
            if is_taken:
                is_taken = False
                self._free.release()

        asyncio.get_running_loop().call_later(SLOW_S, give_back)
        return give_back


async def _ask(api: str, method: str) -> Any:
    """The value of a node's answer; None when it is no answer of the ROS kind.

    Raises what `call_async` raises.
    """
    try:
        answer = await call_async(api, method, MASTER_ID, timeout_s=ANSWER_S)
    except ValueError as error:
        raise Unreachable(api, str(error)) from None
    return answer[2] if isinstance(answer, list) and len(answer) == 3 and answer[0] == 1 else None


async def who_answers(nodes: dict[str, str], timeout_s: float) -> set[str]:
    """Which of the nodes (name to API) are to be taken over from before a crash of the master.

    Those that answer, unless under another name, and those that give no answer in time; not those
    whose connection is refused.
    """
    places = asyncio.Semaphore(ASKED_AT_A_TIME * 5)

    async def is_there(node: str, api: str) -> bool:
        async with places:
            try:
                name = await asyncio.wait_for(_ask(api, "getName"), timeout_s)
            except Fault:
                return True
            except asyncio.TimeoutError:
                return True
            except Unreachable as error:
                return not isinstance(error.__cause__, ConnectionRefusedError)
            except PiprosError:
                return False
            return not isinstance(name, str) or not name or name == node

    found = await asyncio.gather(*(is_there(node, api) for node, api in nodes.items()))
    return {node for node, there in zip(nodes, found, strict=True) if there}
