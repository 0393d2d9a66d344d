"""A node's registrations with the master, which are repeated after the master has restarted.

The node keeps a connection to the master open. Every five seconds, and once a second while the connection is
closed, as by a master that ended, it asks whether it is registered. If not, it repeats all registrations.
Links between nodes do not depend on the master, so they stay open.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from pipros.basics.errors import Interrupted, PiprosError, ProtocolError, Refused, Unreachable
from pipros.basics.printable import listed
from pipros.net.master_client import MasterClient
from pipros.net.rpc_async_client import AsyncRpcClient
from pipros.net.timings import to_tick_s
from pipros.node.timings import NODE_TIMINGS
from pipros.wire.xmlrpc import Fault, encode_call

ASK_INTERVAL_S = 5.0
"""Interval at which the node asks whether it is registered, over a connection that stays open. At 10 Hz, a
question once a second would cost a third of what a message costs."""
AWAY_INTERVAL_S = 1.0
"""The least interval of two questions, and the interval of those to a master that does not answer."""
WATCH_DEADLINE_S = 5.0
"""A master that takes longer to answer is considered busy; the next round checks again."""
UNREGISTERED_AT_ONCE = 20
"""Maximum number of entries that a node unregisters with one call while shutting down."""


class Entry(Protocol):
    """A node's registration with the master. `api` is the URI of the node's slave API."""

    def register(self, master: MasterClient, api: str, /) -> None: ...

    def unregistration(self, api: str, /) -> tuple[str, ...]:
        """Return the method and the parameters of the call that unregisters the entry."""
        ...

    def __str__(self) -> str:
        """Return a description for log messages: `publication [/chatter]`."""
        ...


class PublicationEntry:
    __slots__ = ("topic", "type")

    def __init__(self, topic: str, type_name: str) -> None:
        self.topic = topic
        self.type = type_name

    def register(self, master: MasterClient, api: str) -> None:
        master.register_publisher(self.topic, self.type, api)

    def unregistration(self, api: str) -> tuple[str, ...]:
        return "unregisterPublisher", self.topic, api

    def __str__(self) -> str:
        return f"publication [{self.topic}]"


class SubscriptionEntry:
    """A subscription.

    `ask` is called before each registration, and returns a function that takes the master's list of
    publishers.
    """

    __slots__ = ("ask", "topic", "type")

    def __init__(
        self, topic: str, type_name: str, ask: Callable[[], Callable[[Sequence[str]], object]]
    ) -> None:
        self.topic = topic
        self.type = type_name
        self.ask = ask

    def register(self, master: MasterClient, api: str) -> None:
        take = self.ask()
        take(master.register_subscriber(self.topic, self.type, api))

    def unregistration(self, api: str) -> tuple[str, ...]:
        return "unregisterSubscriber", self.topic, api

    def __str__(self) -> str:
        return f"subscription [{self.topic}]"


class ServiceEntry:
    __slots__ = ("service", "service_uri")

    def __init__(self, service: str, service_uri: str) -> None:
        self.service = service
        self.service_uri = service_uri

    def register(self, master: MasterClient, api: str) -> None:
        master.register_service(self.service, self.service_uri, api)

    def unregistration(self, _api: str) -> tuple[str, ...]:
        return "unregisterService", self.service, self.service_uri

    def __str__(self) -> str:
        return f"service [{self.service}]"


class ParameterEntry:
    __slots__ = ("key", "on_value")

    def __init__(self, key: str, on_value: Callable[[object], object]) -> None:
        self.key = key
        self.on_value = on_value

    def register(self, master: MasterClient, api: str) -> None:
        self.on_value(master.subscribe_param(api, self.key))

    def unregistration(self, api: str) -> tuple[str, ...]:
        return "unsubscribeParam", api, self.key

    def __str__(self) -> str:
        return f"parameter [{self.key}]"


class Registrations:
    """Keeps a node's registrations with the master up to date."""

    def __init__(
        self,
        master: MasterClient,
        node_name: str,
        api: str,
        log: logging.Logger,
        *,
        unregister_s: float = NODE_TIMINGS.unregister_s,
    ) -> None:
        """Store the settings. `close` waits at most `unregister_s` for a master that does not answer."""
        self._master = master
        self._node_name = node_name
        self._api = api
        self._log = log
        self._unregister_s = unregister_s
        self._entries: list[Entry] = []
        self._failed: set[Entry] = set()
        self._refused: set[Entry] = set()
        self._observers: list[Callable[[Entry, bool], object]] = []
        self._lock = threading.RLock()  # prevents entries from changing during a re-registration
        self._is_closed = False

    def add(self, entry: Entry) -> None:
        """Register an entry.

        A refusal is logged. If the master cannot be reached, `watch` registers the entry once a master
        answers.
        """
        with self._lock:
            if not self._is_closed:
                self._entries.append(entry)
                self._register(entry)
                self._notify_observers(entry, is_added=True)

    def renew(self, entry: Entry) -> None:
        """Register an entry again to get the master's response, unless the entry has been removed."""
        with self._lock:
            if entry in self._entries and not self._is_closed:
                self._register(entry)

    def is_replaced(self) -> bool:
        """Return whether another node with this name is registered, or False if no master answers. Blocks."""
        try:
            api: object = self._master.call("lookupNode", self._node_name, timeout_s=WATCH_DEADLINE_S)
        except PiprosError:
            return False
        return isinstance(api, str) and api != self._api

    def remove(self, entry: Entry) -> None:
        """Unregister an entry. Do nothing after `close`, which has unregistered all entries."""
        with self._lock:
            if entry in self._entries:
                if self._unregister(entry, self._master) or not self._is_closed:
                    # An entry whose call was interrupted by `close` is kept: `close` unregisters it.
                    self._entries.remove(entry)
                    self._failed.discard(entry)
                    self._refused.discard(entry)
                self._notify_observers(entry, is_added=False)

    def observe(self, observer: Callable[[Entry, bool], object]) -> None:
        """Call `observer` with each entry that is added (True) or removed (False) from now on.

        It is called while the entries are locked, and must not raise.
        """
        self._observers.append(observer)

    def _notify_observers(self, entry: Entry, *, is_added: bool) -> None:
        for observer in self._observers:
            observer(entry, is_added)

    def close(self) -> None:
        """Unregister all entries in reverse order. Give up if the master does not answer."""
        self._is_closed = True
        # A thread that is still registering an entry holds the lock, and might wait forever. A responsive
        # master answers within the grace period, so calls in progress, such as `get_param`, return normally.
        self._master.interrupt(self._unregister_s, grace_s=self._unregister_s / 3)
        master = MasterClient(self._master.uri, self._node_name, timeout_s=self._unregister_s)
        with self._lock:
            entries = self._entries[::-1]
            self._entries.clear()
            while entries and self._unregister_all(entries[:UNREGISTERED_AT_ONCE], master):
                del entries[:UNREGISTERED_AT_ONCE]
        master.close()

    def _unregister_all(self, entries: Sequence[Entry], master: MasterClient) -> bool:
        """Unregister the entries, with one call if possible. Return False if the master does not answer."""
        try:
            master.call_together([entry.unregistration(self._api) for entry in entries])
        except (Fault, ProtocolError, ValueError):  # no `system.multicall`, or an invalid name
            return all(self._unregister(entry, master) for entry in entries)
        except PiprosError:
            return False
        return True

    async def watch(self) -> None:
        """Register all entries again whenever the node is not registered. Runs until cancelled."""
        client = AsyncRpcClient(self._master.uri)
        try:
            await self._watch(client)
        finally:
            client.close()

    async def _watch(self, client: AsyncRpcClient) -> None:
        # One connection and one encoded request are reused, because an idle node should cost almost nothing.
        question = encode_call("lookupNode", (self._node_name, self._node_name))
        loop = asyncio.get_running_loop()
        is_away = False
        while True:
            last = loop.time()
            if not self._failed:
                await client.wait_while_connected(to_tick_s(ASK_INTERVAL_S))
            if (left_s := last + AWAY_INTERVAL_S - loop.time()) > 0:
                await asyncio.sleep(left_s)
            if len(self._refused) == len(self._entries):  # the master need not know this node
                continue
            try:
                answer = await client.post(question, timeout_s=WATCH_DEADLINE_S)
            except PiprosError as error:
                if not is_away and isinstance(error, Unreachable):
                    is_away = True
                    self._log.debug("lost the master at %s: %s", self._master.uri, error.reason)
                continue
            is_away = False
            if _has_forgotten(answer):
                await loop.run_in_executor(None, self._register_all)
            elif self._failed:
                await loop.run_in_executor(None, self._register_failed)

    def _register_all(self) -> None:
        with self._lock:
            if not self._is_closed:
                self._log.debug("the master has forgotten this node: registering again")
                for entry in self._entries:
                    self._register(entry)

    def _register_failed(self) -> None:
        with self._lock:
            for entry in list(self._failed):
                if not self._is_closed:
                    self._register(entry)

    def _register(self, entry: Entry) -> None:
        self._failed.discard(entry)
        self._refused.discard(entry)
        try:
            entry.register(self._master, self._api)
        except Refused as error:
            self._refused.add(entry)
            self._log.fatal("unable to register %s with master: %s", entry, error.text)
        except ValueError as error:  # XML cannot represent a name
            self._refused.add(entry)
            self._log.fatal("unable to register %s with master: %s", listed(entry), error)
        except Interrupted:
            pass  # the node is shutting down
        except PiprosError as error:
            self._failed.add(entry)
            self._log.error("unable to register %s with master: %s. Will keep trying.", entry, error)

    def _unregister(self, entry: Entry, master: MasterClient) -> bool:
        try:
            master.call(*entry.unregistration(self._api))
        except (Refused, ValueError):
            pass  # the entry is not registered
        except PiprosError:
            return False
        return True


def _has_forgotten(answer: Any) -> bool:
    """Return whether a master's response says that the node is unknown, or False if it is malformed."""
    return isinstance(answer, list) and answer[:1] in ([-1], [0])
