"""Pings nodes: checks whether they answer, and how fast."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from socket import gaierror
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError, Refused
from pipros.basics.printable import listed, printable
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import Fault, RpcClient
from pipros_tools.graph.nodes import node_names
from pipros_tools.graph.output import bullets, to_stderr

if TYPE_CHECKING:
    from pipros.basics.printable import Say

TIMEOUT_S = 3.0
PERIOD_S = 1.0


def ask_pid(api: str, caller_id: str, timeout_s: float = TIMEOUT_S) -> object:
    """Call `getPid` on the node at this URI. Raises the same errors as `RpcClient.call`."""
    with RpcClient(api, timeout_s=timeout_s) as client:
        return client.call("getPid", caller_id)


def ping(
    master: MasterClient,
    node: str,
    *,
    count: int | None = 1,
    say: Say | None = None,
    complain: Say = to_stderr,
    pause: Callable[[float], object] = time.sleep,
    ask: Callable[[str, str], object] | None = None,
    clock: Callable[[], float] = time.perf_counter,
    timeout_s: float = TIMEOUT_S,
) -> bool:
    """Ping a node once a second, `count` times, or endlessly if `count` is None or 0.

    Ctrl-C stops pinging. If a ping fails, return False and pass the reason to `complain`.

    Args:
        ask: function that calls the node at a URI on behalf of a caller; defaults to `ask_pid`.
        clock: function that returns the time in seconds, for measuring round trips.
        timeout_s: timeout of each ping.

    Raises:
        Unreachable: the *master* does not answer.
    """
    ask = ask or partial(ask_pid, timeout_s=timeout_s)
    pings = _Pings(master, node, say, complain, ask, clock, timeout_s)
    if not pings.find():
        return False
    try:
        is_answered = pings.repeat(count, pause)
    except KeyboardInterrupt:
        is_answered = True
    if is_answered:
        pings.conclude()
    return is_answered


def ping_all(
    master: MasterClient,
    say: Say | None = None,
    *,
    complain: Say = to_stderr,
    ask: Callable[[str, str], object] = ask_pid,
) -> tuple[list[str], list[str]]:
    """Ping every node once. Return the nodes that answered, and those that did not.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed.
        Unreachable: the *master* does not answer.
    """
    nodes = node_names(master)
    if say:
        say(bullets("Will ping the following nodes: ", nodes) + "\n")
    answered: list[str] = []
    silent: list[str] = []
    for node in nodes:
        pings = _Pings(master, node, say, complain, ask, time.perf_counter, TIMEOUT_S)
        is_answered = pings.find() and pings.repeat(1, time.sleep)
        (answered if is_answered else silent).append(node)
    return answered, silent


class _Pings:
    """The pings sent to one node so far."""

    def __init__(
        self,
        master: MasterClient,
        node: str,
        say: Say | None,
        complain: Say,
        ask: Callable[[str, str], object],
        clock: Callable[[], float],
        timeout_s: float,
    ) -> None:
        self.durations_ms: list[float] = []
        self._master = master
        self._node = node
        self._say = say
        self._report = complain
        self._ask = ask
        self._clock = clock
        self._timeout_s = timeout_s
        self._api = ""

    def find(self) -> bool:
        """Look up the node's URI; return False if the node is not registered."""
        try:
            self._api = self._master.lookup_node(self._node)
        except Refused:
            self._report(f"cannot ping [{listed(self._node)}]: unknown node")
            return False
        return True

    def repeat(self, count: int | None, pause: Callable[[float], object]) -> bool:
        """Ping until `count` pings have been answered, or without end if `count` is None or 0.

        Return False if a ping is not answered, unless the node's URI has changed: the new URI is pinged then.
        """
        if self._say:
            self._say(f"pinging {listed(self._node)} with a timeout of {self._timeout_s}s")
        is_first = True
        while not count or len(self.durations_ms) < count:
            if not is_first:
                pause(PERIOD_S)
            is_first = False
            if not self.send():
                return False
        return True

    def send(self) -> bool:
        """Ping once; return False if there is no answer."""
        start = self._clock()
        try:
            self._ask(self._api, self._master.caller_id)
        except Fault:
            pass  # the node answered, although getPid failed
        except (PiprosError, ValueError) as error:
            return self._explain(error)
        duration_ms = (self._clock() - start) * 1000
        self.durations_ms.append(duration_ms)
        if self._say:
            self._say(f"xmlrpc reply from {listed(self._api)}\ttime={duration_ms:f}ms")
        return True

    def _explain(self, error: Exception) -> bool:
        """Print why the node did not answer. Return True if its URI changed and a retry may succeed."""
        cause = error.__context__
        if isinstance(cause, ConnectionRefusedError):
            old_api = self._api
            if self.find() and self._api != old_api:
                moved = f"from [{listed(old_api)}] to [{listed(self._api)}]"
                self._report(f"node url has changed {moved}, retrying to ping")
                return True
            self._report(f"ERROR: connection refused to [{listed(old_api)}]")
        elif isinstance(cause, gaierror):
            host = self._api.partition("://")[2].rpartition(":")[0]
            self._report(f"ERROR: Unknown host [{listed(host)}] for node [{listed(self._node)}]")
            from pipros.net.unreachable import advice_on  # imports asyncio

            self._report(advice_on(listed(host), cause).removeprefix(". "))
        elif isinstance(cause, TimeoutError):
            self._report(f"connection to [{listed(self._node)}] timed out")
        else:
            self._report(f"ERROR: communication with node [{listed(self._node)}] failed: {printable(error)}")
        return False

    def conclude(self) -> None:
        if self._say and len(self.durations_ms) > 1:
            self._say(f"ping average: {sum(self.durations_ms) / len(self.durations_ms):f}ms")
