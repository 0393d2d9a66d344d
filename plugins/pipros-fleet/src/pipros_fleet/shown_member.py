"""Show another member's topics and services on the local master, below `/<member>`."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from pipros.basics.budget import Budget
from pipros.basics.errors import PiprosError
from pipros.msg.class_finder import installed_class
from pipros.msg.language.full_text import DEFINITION_BYTES
from pipros.net.shared_workers import SharedWorkers
from pipros.node import Node
from pipros_fleet import keys
from pipros_fleet.calls import RemoteService
from pipros_fleet.directory import Directory, DirectoryEntry, read_json
from pipros_fleet.fleet_rules import FleetRule, Priority
from pipros_fleet.local_graph import outcome_topics
from pipros_fleet.messages import ReceivedMessage
from pipros_fleet.sinks import Sink, SinkRoom
from pipros_fleet.sources import Sender, SentTopic
from pipros_fleet.warnings_once import WarningsOnce
from pipros_fleet.zenoh_session import Ends, LinkFailed, SessionLink

FLEET_DEFINITION_BYTES = 64 * 1024 * 1024
"""Maximum total size of the other members' message definitions that a member keeps, or that a router keeps
for its history. Beyond it, further topics are shown or recorded without definitions, which is reported; a
member can use at most half of the memory that other members leave free.
"""

_REQUEST_S: Final = 3.0
_CLIENT_S: Final = 1.0
"""Maximum time that results wait for an action client to be connected again."""
_RESULT_S: Final = 0.1
"""Time for which status messages wait until action clients have handled replayed results. A client gives up
its goal if a status message lacks it, and two topics have no order.
"""
_INPUTS: Final = FleetRule("/**", priority=Priority.HIGH)
"""Rule for messages to topics of other members. These are commands, so they have high priority."""


class ShownMember:
    """Another member's topics and services on the local master. Not thread-safe.

    Attributes:
        directory: the member's directory. Call `update` after replacing it.
        sinks: the topics that the member shares, by their names on its master.
        inputs: the topics that the member accepts, by their names on its master.
        services: the member's services, by their names on its master.
        results: what was received on results' topics before the member left, by their names on its master.
    """

    def __init__(
        self,
        node: Node,
        link: SessionLink,
        sender: Sender,
        me: str,
        directory: Directory,
        workers: SharedWorkers,
        definition_bytes: Budget,
        room: SinkRoom,
        wake: Callable[[], object],
    ) -> None:
        """Store the settings.

        Args:
            definition_bytes: maximum size of all members' definitions; each member gets at most half of the
                memory that the other members leave.
            wake: called from any thread if `update` has something to do.
        """
        self.directory = directory
        self.sinks: dict[str, Sink] = {}
        self.inputs: dict[str, SentTopic] = {}
        self.services: dict[str, RemoteService] = {}
        self.results: dict[str, ReceivedMessage] = {}
        self._node = node
        self._link = link
        self._sender = sender
        self._me = me
        self._workers = workers
        self._wake = wake
        self._warn = WarningsOnce(node.log)
        self._definition_bytes = Budget(definition_bytes.limit, definition_bytes, part=0.5)
        self._room = room
        self._definitions: dict[tuple[str, str], str | None] = {}
        self._taken_bytes: dict[tuple[str, str], int] = {}
        self._lock = threading.Lock()
        self._received: dict[str, Ends] = {}
        self._refused: set[DirectoryEntry] = set()
        self._is_closed = False

    @contextmanager
    def _once(self, entry: DirectoryEntry) -> Iterator[None]:
        """Suppress a PiprosError in the block: log that `entry` is not shown, and do not try again."""
        try:
            yield
        except PiprosError as error:
            self._refused.add(entry)
            self._warn(f"[{entry.name}] of [{self.directory.member}] is not shown: {error}")

    def update(self, max_names: int) -> None:
        """Make the topics and services on the local master match the directory.

        `max_names` is the maximum number of topics and services to show.
        """
        directory = self.directory
        shared = directory.shared[:max_names]
        accepted = directory.accepted[: max_names - len(shared)]
        services = directory.services[: max_names - len(shared) - len(accepted)]
        self._forget({*shared, *accepted, *services})
        self._update_sinks({entry.name: entry for entry in shared})
        self._update_inputs({entry.name: entry for entry in accepted})
        self._update_services({entry.name: entry for entry in services})
        wanted = {name for name, sink in self.sinks.items() if sink.is_wanted or sink.is_owed}
        wanted.update(
            outcome
            for entry in shared
            if entry.name in wanted
            for outcome in outcome_topics(entry)
            if outcome in self.sinks
        )
        for name in wanted - self._received.keys():
            self._receive(name, self.sinks[name])
        for name in self._received.keys() - wanted:
            self._received.pop(name).undeclare()

    def wanted(self) -> frozenset[str]:
        """Return the topics to which local nodes subscribe.

        For the status topic of an action, the feedback and result topics are added.
        """
        return frozenset(self._received) | self.results.keys()

    def close(self) -> None:
        """Remove everything from the local master."""
        self._is_closed = True
        self._forget(set())
        self._update_sinks({})
        self._update_inputs({})
        self._update_services({})
        self._definition_bytes.close()

    def _forget(self, offered: set[DirectoryEntry]) -> None:
        """Forget all definitions and errors except those of the given entries."""
        self._refused &= offered
        with self._lock:
            for key in self._definitions.keys() - {(entry.type, entry.md5sum) for entry in offered}:
                del self._definitions[key]
                self._definition_bytes.give_back(self._taken_bytes.pop(key, 0))

    def _local(self, entry: DirectoryEntry) -> DirectoryEntry:
        return DirectoryEntry(
            f"/{self.directory.member}{entry.name}", entry.type, entry.md5sum, entry.timeout_s
        )

    def _update_sinks(self, offered: dict[str, DirectoryEntry]) -> None:
        for name, sink in list(self.sinks.items()):
            if name not in offered or self._local(offered[name]) != sink.entry:
                del self.sinks[name]
                if name in self._received:
                    self._received.pop(name).undeclare()
                sink.close()
        for name, entry in offered.items():
            is_new = name not in self.sinks and entry not in self._refused
            text = self._definition(entry) if is_new else None
            if text is not None:
                with self._once(entry):
                    self.sinks[name] = Sink(
                        self._node,
                        self._local(entry),
                        self.directory.member,
                        text,
                        self._node.log,
                        self._wake,
                        self._room,
                    )
                    if name in self.results:
                        self.sinks[name].received[self.directory.member] = self.results.pop(name)
                        self.sinks[name].is_owed = True

    def _update_inputs(self, offered: dict[str, DirectoryEntry]) -> None:
        for name, source in list(self.inputs.items()):
            if name not in offered or self._local(offered[name]) != source.entry:
                del self.inputs[name]
                source.close()
        for name, entry in offered.items():
            if name not in self.inputs and entry not in self._refused:
                key = keys.into(self._me, self.directory.member, name)
                source = SentTopic(self._node, self._sender, self._local(entry), key, _INPUTS)
                with self._once(entry):
                    source.start()
                    self.inputs[name] = source

    def _update_services(self, offered: dict[str, DirectoryEntry]) -> None:
        for name, service in list(self.services.items()):
            if offered.get(name) != service.entry:
                del self.services[name]
                service.close()
        for name, entry in offered.items():
            if name not in self.services and entry not in self._refused:
                with self._once(entry):
                    self.services[name] = RemoteService(
                        self._node, self._link, self._me, self.directory.member, entry
                    )

    def _receive(self, name: str, sink: Sink) -> None:
        """Start receiving a topic, and request its latched messages.

        Status messages of an action are dropped while its results are owed.
        """
        member = self.directory.member
        if not sink.is_owed:
            sink.restart()
        key = keys.topic(member, name)
        outcome = outcome_topics(replace(sink.entry, name=name))

        def take(_: str, payload: bytes, attachment: bytes) -> None:
            if not any(each.is_owed for each in map(self.sinks.get, outcome) if each is not None):
                sink.take(member, payload, attachment)

        self._received[name] = self._link.subscribe(key, take)
        self._workers.run(member, self._replay, key, sink)

    def _replay(self, key: str, sink: Sink) -> None:
        until_s = time.monotonic() + _CLIENT_S
        while sink.is_owed and not sink.is_wanted and not self._is_closed and time.monotonic() < until_s:
            time.sleep(0.02)
        try:
            for answer in self._link.get(key, timeout_s=_REQUEST_S, ended=lambda: self._is_closed):
                sink.take(self.directory.member, answer.payload, answer.attachment, is_replay=True)
        except LinkFailed as error:
            self._node.log.debug("%s", error)
        if sink.is_owed and self._link.is_connected:  # otherwise, they are requested again
            time.sleep(_RESULT_S)
            sink.is_owed = False

    def miss(self) -> None:
        """Note that results may be missed, because the link was lost. Thread-safe."""
        for name in tuple(self._received):
            sink = self.sinks.get(name)
            if sink is not None:
                sink.is_owed = sink.is_result

    def received_results(self) -> dict[str, ReceivedMessage]:
        """Return the next value of `results`, for when the member returns."""
        member = self.directory.member
        found = {name: self.sinks[name] for name in self._received if self.sinks[name].is_result}
        counts = {name: sink.received.get(member) for name, sink in found.items()}
        return self.results | {
            name: ReceivedMessage(remembers=True) if each is None else each for name, each in counts.items()
        }

    def replay(self) -> None:
        """Request latched messages and results of all received topics again, because the link was lost."""
        member = self.directory.member
        for name in self._received:
            self._workers.run(member, self._replay, keys.topic(member, name), self.sinks[name])

    # -- definitions ------------------------------------------------------------------

    def _definition(self, entry: DirectoryEntry) -> str | None:
        """Return the definition of a message type, or None while it is being requested."""
        key = entry.type, entry.md5sum
        with self._lock:
            if key in self._definitions:
                return self._definitions[key]
        found = installed_class(entry.type)
        has_same = found is not None and found._md5sum == entry.md5sum
        text = found._full_text if found is not None and has_same else None
        with self._lock:
            self._definitions[key] = text
        if text is None and not self._workers.run(self.directory.member, self._request_definition, key):
            del self._definitions[key]  # requested again later
        return text

    def _request_definition(self, key: tuple[str, str]) -> None:
        """Request a message type's definition and store it, or an empty string if no valid reply arrives."""
        kind, md5sum = key
        text = ""
        if self._definitions.get(key, "") is not None:
            return  # received in the meantime, or no longer needed
        try:
            for answer in self._link.get(
                keys.definition(self.directory.member, kind),
                timeout_s=_REQUEST_S,
                ended=lambda: self._is_closed,
            ):
                text = read_definition(answer.payload, md5sum, DEFINITION_BYTES) or text
        except PiprosError as error:
            self._node.log.debug("%s", error)
        with self._lock:
            if key in self._definitions and self._definitions[key] is None:
                size_bytes = sys.getsizeof(text)
                if self._definition_bytes.take(size_bytes):
                    self._taken_bytes[key] = size_bytes
                else:
                    text = ""
                    limit = f"the limit is {FLEET_DEFINITION_BYTES} bytes"
                    self._warn(f"there are too many definitions of other members; {limit}")
                self._definitions[key] = text
        self._wake()


def read_definition(content: bytes, md5sum: str, limit_bytes: int) -> str:
    """Decode another member's definition. Return an empty string if it is invalid or has another MD5 sum."""
    match read_json(content) if len(content) <= limit_bytes else None:
        case [str(found), str(text)] if found == md5sum and _is_encodable(text):
            return text
    return ""


def _is_encodable(text: str) -> bool:
    """Return False if a string contains lone surrogates, which JSON permits and UTF-8 does not."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
