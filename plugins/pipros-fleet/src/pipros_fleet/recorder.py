"""Record members' messages at a router, so that operators who join late can see what happened.

The recorder joins the fleet as the member `router`, which offers nothing. It records the messages of shared
topics that pass through the router, and requests further topics itself. Messages to accepted topics are not
recorded.
"""

from __future__ import annotations

import itertools
import json
import logging
import threading
import time
from collections import Counter
from collections.abc import Sequence, Set
from dataclasses import astuple
from typing import Final

from pipros.basics.budget import Budget, SharedBudget
from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits, process_limits
from pipros.basics.turns import Turns
from pipros.msg.class_finder import installed_class
from pipros.msg.language.full_text import DEFINITION_BYTES
from pipros.net.shared_workers import SharedWorkers
from pipros_fleet import keys
from pipros_fleet.access import ROUTER
from pipros_fleet.directory import (
    FLEET_DIRECTORY_BYTES,
    FLEET_MEMBERS,
    FLEET_TOPICS,
    Directory,
    TopicRequests,
    from_json,
    requests_to_json,
    to_json,
)
from pipros_fleet.events import Events
from pipros_fleet.fleet_rules import matches_any
from pipros_fleet.history_files import FILE_BYTES, HistoryFiles
from pipros_fleet.history_topic import MAX_PUBLISHERS, HistoryTopic
from pipros_fleet.limits import FleetLimits
from pipros_fleet.members import Members
from pipros_fleet.messages import decompressed, is_compressed, unpack
from pipros_fleet.shown_member import FLEET_DEFINITION_BYTES, read_definition
from pipros_fleet.sources import FLEET_LATCHED_BYTES
from pipros_fleet.warnings_once import WarningsOnce
from pipros_fleet.zenoh_session import Ends, LinkFailed, SessionLink, ZenohQuestion

_REQUEST_S: Final = 3.0
_ENDING_S: Final = 0.3
_REQUEST_COST: Final = 1 / 16
"""Part of `FLEET_TOPICS` that a question about the history takes of the room: one member may have 32."""
_LATCHED_BYTES: Final = FILE_BYTES // 4
"""Maximum size of a member's latched messages, so that the files have room for other messages."""
_MESSAGE_BYTES: Final = 500
"""Memory of a waiting message besides its content. If it did not count, empty messages had no limit."""
_HEADER_BYTES: Final = 256
"""Approximate size of a connection in a file, without the definition."""


class FleetRecorder:
    """Recorder that uses a router's session. Call `start`, and `close` before closing the session.

    A single thread owns the topics and writes the files, after others have decompressed messages. They never
    delay the router: if they fall behind, messages are dropped.

    Attributes:
        dropped: number of messages that were not recorded.
    """

    def __init__(
        self,
        link: SessionLink,
        files: HistoryFiles,
        instance: str,
        topics: Sequence[str] = (),
        *,
        log: logging.Logger,
        limits: Limits | None = None,
    ) -> None:
        """Store the settings.

        Args:
            topics: names or wildcard patterns of topics to record even if no member requests them.
        """
        self.dropped = 0
        self._link = link
        self._files = files
        self._instance = instance
        self._patterns = topics
        self._limits = limits or process_limits()
        self._warn = WarningsOnce(log)
        self._events = Events(4 * FLEET_MEMBERS)
        self._workers = SharedWorkers("requests of a recorder", 4, 4 * FLEET_TOPICS)
        self._members = Members(FLEET_MEMBERS)
        self._directories: dict[str, Directory] = {}
        self._topics: dict[tuple[str, str], HistoryTopic] = {}
        self._topic_requests: dict[str, TopicRequests] = {}
        self._revisions = itertools.count(1)
        self._definition_bytes = Budget(FLEET_DEFINITION_BYTES)
        self._latched_bytes: Counter[str] = Counter()
        room = self._limits.of(FleetLimits).fleet_queue_bytes
        self._inflating = SharedWorkers("compressed messages of a recorder", 2, room, each=1)
        self._waiting: Turns[str, tuple[str, bytes, bytes, bool]] = Turns()
        self._waiting_bytes = SharedBudget(room)
        self._lock = threading.Lock()
        self._declared: list[Ends] = []
        self._thread = threading.Thread(target=self._run, name="recorder of a fleet", daemon=True)

    def start(self) -> None:
        """Start recording."""
        link, directory = self._link, to_json(Directory(ROUTER, self._instance, 1))
        self._thread.start()
        self._workers.run(None, self._files.recover, cost=0)  # leaves the shares of members as they are
        self._declared = [
            link.serve(keys.directory(ROUTER), lambda question: _answer(question, directory)),
            link.serve(keys.wanted(ROUTER, "*"), self._answer_requests),
            link.serve(keys.history("*"), self._on_history_request),
            link.serve(keys.history("*", "*"), self._on_history_request),
            link.subscribe(keys.directory("*"), self._on_directory),
            link.subscribe(keys.topic("*", keys.EVERY), self._on_message),
            link.declare_token(keys.live(ROUTER, keys.VERSION, self._instance)),
            link.watch_tokens(keys.live("*"), self._on_token),
        ]

    def close(self) -> None:
        """Stop recording and complete the files."""
        self._events.close()
        self._workers.close()
        self._inflating.close()
        self._thread.join(_ENDING_S)
        self._files.close()

    # -- link callbacks; they run in Zenoh's threads and must not block -----------------------------------

    def _on_token(self, key: str, is_present: bool) -> None:
        self._events.post("token", key, lambda: self._take_token(key, is_present=is_present))

    def _on_directory(self, key: str, payload: bytes, attachment: bytes) -> None:
        del attachment
        match keys.parts(key):
            case (member, "directory", []) if member != ROUTER:
                self._events.post("directory", member, lambda: self._take_directory(member, payload))

    def _on_message(self, key: str, payload: bytes, attachment: bytes, *, is_replay: bool = False) -> None:
        member, item = key.split("/")[1], (key, payload, attachment, is_replay)
        if not is_compressed(attachment):
            self._put(member, item)
        elif not self._inflating.run(member, self._inflate, member, item, cost=_memory_bytes(item)):
            self._drop()

    def _put(self, member: str, item: tuple[str, bytes, bytes, bool]) -> None:
        with self._lock:
            if len(item[1]) > FILE_BYTES or not self._waiting_bytes.take(member, _memory_bytes(item)):
                self._drop()
                return
            self._waiting.put(member, item)
        self._events.wake()

    def _answer_requests(self, question: ZenohQuestion) -> None:
        requests = self._topic_requests.get(question.asker, TopicRequests(self._instance))
        _answer(question, requests_to_json(requests))

    def _on_history_request(self, question: ZenohQuestion) -> None:
        cost = FLEET_TOPICS * _REQUEST_COST
        if not self._workers.run(question.asker, self._answer_history, question, cost=cost):
            question.refuse("the router has too many requests for its history; try again later")
            question.close()

    # -- workers ------------------------------------------------------------------------------------

    def _inflate(self, member: str, item: tuple[str, bytes, bytes, bool]) -> None:
        try:
            self._put(member, (item[0], decompressed(item[1], FILE_BYTES), *item[2:]))
        except PiprosError:
            self._drop()

    def _answer_history(self, question: ZenohQuestion) -> None:
        try:
            match keys.parts(question.key):
                case (_, "history", [member]):
                    rows = [astuple(each) for each in self._files.list(keys.member_name(member))]
                    question.answer(json.dumps(rows).encode())
                case (_, "history", [member, name]):
                    content = self._files.read(keys.member_name(member), name)
                    limit = self._limits.of(FleetLimits).fleet_message_bytes
                    if content is not None and len(content) <= limit:
                        question.answer(content)
        except (PiprosError, OSError) as error:
            question.refuse(str(error))
        finally:
            question.close()

    def _request_directory(self, member: str) -> None:
        try:
            for answer in self._link.get(
                keys.directory(member), timeout_s=_REQUEST_S, ended=lambda: self._events.is_closed
            ):
                self._on_directory(answer.key, answer.payload, b"")
        except LinkFailed as error:
            self._warn(str(error), member)

    def _prepare(self, topic: HistoryTopic) -> None:
        """Obtain the definition of a topic, then its latched messages."""
        entry, text = topic.entry, ""
        found = installed_class(entry.type)
        try:
            if found is not None and found._md5sum == entry.md5sum:
                text = found._full_text
            else:
                for answer in self._link.get(keys.definition(topic.member, entry.type), timeout_s=_REQUEST_S):
                    text = read_definition(answer.payload, entry.md5sum, DEFINITION_BYTES) or text
            self._keep_definition(topic, text.encode())
            key = keys.topic(topic.member, entry.name)
            for answer in self._link.get(key, timeout_s=_REQUEST_S):
                self._on_message(key, answer.payload, answer.attachment, is_replay=True)
        except LinkFailed as error:
            self._warn(str(error), topic.member)
        self._events.post("requests", topic.member, lambda: self._publish_requests(topic.member))

    def _keep_definition(self, topic: HistoryTopic, definition: bytes) -> None:
        with self._lock:
            if topic.is_forgotten:
                return
            if self._definition_bytes.take(len(definition)):
                topic.taken_bytes = len(definition)
            else:
                definition = b""
                self._warn(f"too many definitions of members; the limit is {FLEET_DEFINITION_BYTES} bytes")
            topic.definition = definition

    # -- the thread ---------------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._events.is_closed:
            event = self._events.next(None)
            try:
                if event is not None:
                    event()
                while (found := self._next_message()) is not None:
                    self._record(*found)
            except LinkFailed:
                return  # the session was closed
            except Exception as error:  # one member's data must not stop the recording of other members
                self._warn(f"the history is incomplete: {str(error) or type(error).__name__}", "?")
                self._events.wake()  # other messages may be waiting

    def _next_message(self) -> tuple[str, bytes, bytes, bool] | None:
        with self._lock:
            if not self._waiting:
                return None
            member, found = self._waiting.pop()
            self._waiting_bytes.give_back(member, _memory_bytes(found))
            return found

    def _take_token(self, key: str, *, is_present: bool) -> None:
        token = self._members.update(key, is_present=is_present)
        found = keys.read_live(key)
        if is_present and found is not None and not self._members.of(found[0]):
            self._warn(f"too many members; the limit is {FLEET_MEMBERS}")
        if token is None or token.version != keys.VERSION:
            return
        if token.member == ROUTER:
            if is_present and token.instance != self._instance:
                self._warn("another router also records the history of this fleet; only one router should")
        elif token.member in self._members.present():
            self._workers.run(token.member, self._request_directory, token.member)
        else:
            self._forget(token.member)

    def _forget(self, member: str) -> None:
        """Forget a member that has left, and complete its file."""
        self._directories.pop(member, None)
        self._forget_topics(member, frozenset())
        self._topic_requests.pop(member, None)
        self._latched_bytes.pop(member, None)
        self._files.forget(member)

    def _forget_topics(self, member: str, kept: Set[str]) -> None:
        """Forget all topics of a member except those in `kept`."""
        gone = [key for key in self._topics if key[0] == member and key[1] not in kept]
        for key in gone:
            topic = self._topics.pop(key)
            self._latched_bytes[member] -= sum(topic.latched.values())
            self._forget_definition(topic)
        if gone:
            self._files.forget_latched(member, {f"/{member}{name}" for _, name in gone})

    def _forget_definition(self, topic: HistoryTopic) -> None:
        with self._lock:
            topic.is_forgotten = True
            self._definition_bytes.give_back(topic.taken_bytes)

    def _take_directory(self, member: str, payload: bytes) -> None:
        token = self._members.present().get(member)
        if token is None:
            return
        directory = from_json(payload, member, FLEET_DIRECTORY_BYTES)
        before = self._directories.get(member)
        if directory.instance != token.instance:
            return
        if before is not None and before.instance == directory.instance:
            if directory.revision < before.revision:
                return
        else:
            self._topic_requests.pop(member, None)
        self._directories[member] = directory
        self._forget_topics(member, {entry.name for entry in directory.shared})
        for entry in directory.shared:
            if matches_any(self._patterns, entry.name):
                self._topic(member, entry.name)
        self._publish_requests(member)

    def _topic(self, member: str, name: str) -> HistoryTopic | None:
        """Return a topic, added if necessary, or None if it is not shared or there are too many topics."""
        directory = self._directories.get(member)
        entries = directory.shared if directory is not None else ()
        entry = next((each for each in entries if each.name == name), None)
        topic = self._topics.get((member, name))
        if directory is None or entry is None:
            return None
        if topic is None or topic.entry != entry or topic.instance != directory.instance:
            own = sum(each == member for each, _ in self._topics) if topic is None else 0
            if topic is None and 2 * own >= FLEET_TOPICS - (len(self._topics) - own):
                self._warn(f"too many topics; the limit is {FLEET_TOPICS}")
                return None
            latched = topic.latched if topic is not None else {}
            if topic is not None:
                self._forget_definition(topic)
            self._topics[member, name] = topic = HistoryTopic(member, entry, directory.instance, latched)
            self._workers.run(member, self._prepare, topic)
        return topic

    def _publish_requests(self, member: str) -> None:
        """Request a member's topics that match the patterns and have been processed by `_prepare`."""
        if member not in self._directories:
            return  # the member has left
        wanted = frozenset(
            name
            for (owner, name), topic in self._topics.items()
            if owner == member and topic.definition is not None and matches_any(self._patterns, name)
        )
        sent = self._topic_requests.get(member)
        if sent is None or sent.topics != wanted:
            self._topic_requests[member] = requests = TopicRequests(
                self._instance, next(self._revisions), wanted
            )
            self._link.put(keys.wanted(ROUTER, member), requests_to_json(requests), waits=True)

    def _record(self, key: str, body: bytes, attachment: bytes, is_replay: bool) -> None:
        match keys.parts(key):
            case (member, "t", rest):
                topic = self._topic(member, keys.unmangled("/".join(rest)))
            case _:
                return
        try:
            found = unpack(attachment)
        except PiprosError:
            topic = None
        if topic is None or topic.definition is None or found.md5sum != topic.entry.md5sum:
            self._drop()
        elif topic.received.is_new(found, len(body), is_replay=is_replay):
            is_latched = found.is_latched and self._may_keep(topic, found.source, len(body))
            connection = topic.connection(found.source, is_latched=is_latched)
            self._files.write(member, connection, time.time_ns(), body)

    def _may_keep(self, topic: HistoryTopic, source: int, body_bytes: int) -> bool:
        """Reserve room to repeat a latched message in later files. Return False if there is no room."""
        size = body_bytes + len(topic.definition or b"") + _HEADER_BYTES
        if source not in topic.latched and len(topic.latched) >= MAX_PUBLISHERS:
            return False
        added = size - topic.latched.get(source, 0)
        if (
            self._latched_bytes[topic.member] + added > _LATCHED_BYTES
            or self._latched_bytes.total() + added > FLEET_LATCHED_BYTES
        ):
            return False
        self._latched_bytes[topic.member] += added
        topic.latched[source] = size
        return True

    def _drop(self) -> None:
        self.dropped += 1


def _memory_bytes(item: tuple[str, bytes, bytes, bool]) -> int:
    return len(item[0]) + len(item[1]) + len(item[2]) + _MESSAGE_BYTES


def _answer(question: ZenohQuestion, payload: bytes) -> None:
    question.answer(payload)
    question.close()
