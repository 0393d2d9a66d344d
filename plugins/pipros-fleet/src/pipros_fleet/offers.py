"""The topics that this member shares with other members, and the topics that it accepts from them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace

from pipros.node import Node
from pipros_fleet import keys
from pipros_fleet.directory import (
    FLEET_DIRECTORY_BYTES,
    Directory,
    TopicRequests,
    requests_from_json,
    to_json,
)
from pipros_fleet.fleet_rules import FleetFile
from pipros_fleet.frames import frame_change
from pipros_fleet.local_graph import LocalGraph, is_result, outcome_topics
from pipros_fleet.members import Token
from pipros_fleet.sinks import Sink, SinkRoom
from pipros_fleet.sources import RESULT_S, Sender, SentTopic
from pipros_fleet.zenoh_session import SessionLink, ZenohQuestion
from pipros_tools.graph.system_state import SystemState


class Offers:
    """Sends the topics that other members request, publishes accepted topics, and updates the directory.

    All methods are called by one thread, except the callbacks of the link.

    Attributes:
        local: the last known state of the local master.
        directory: the directory that was last sent.
        shared: topics that are being sent, by name.
        accepted: topics to which other members can publish, by name.
        is_waiting: whether to call `update` again soon, because an action's status topic waits for its
            feedback and result topics to be connected.
    """

    def __init__(
        self,
        node: Node,
        link: SessionLink,
        sender: Sender,
        member: str,
        file: FleetFile,
        present: Callable[[], Mapping[str, Token]],
        room: SinkRoom,
        warn: Callable[[str, str], object],
        wake: Callable[[], object],
    ) -> None:
        """Store the settings.

        Args:
            present: function that returns the tokens of the members that are present; called from any thread.
            warn: function that logs a warning that a member has caused.
            wake: called from any thread if `update` has something to do.
        """
        self.local = LocalGraph(SystemState({}, {}, {}))
        self.directory = Directory(member, sender.instance)
        self._document = to_json(self.directory)
        self.shared: dict[str, SentTopic] = {}
        self.accepted: dict[str, Sink] = {}
        self.is_waiting = False
        self._node = node
        self._link = link
        self._sender = sender
        self._member = member
        self._file = file
        self._present = present
        self._warn = warn
        self._wake = wake
        self._requests: dict[str, TopicRequests] = {}
        self._room = room
        self._kept_until_s: dict[str, float] = {}
        """Result topics that are kept for members that have left and may return."""

    def take_requests(self, member: str, payload: bytes) -> None:
        """Update the topics that a member requests. Malformed and outdated requests are ignored."""
        token, before = self._present().get(member), self._requests.get(member)
        requests = requests_from_json(payload, FLEET_DIRECTORY_BYTES)
        if requests is None or token is None or requests.instance != token.instance or member == self._member:
            return
        if before is None or before.instance != requests.instance or before.revision < requests.revision:
            self._requests[member] = requests

    def forget(self, member: str) -> None:
        """Remove the requests of a member that has left. Results are kept for RESULT_S, as it may return."""
        end_s = time.monotonic() + RESULT_S
        for name in self._requests.pop(member, TopicRequests("")).topics:
            if name in self.shared and is_result(self.shared[name].entry):
                self._kept_until_s[name] = end_s

    def update(self) -> None:
        """Share and accept topics according to the members' requests and the local master's state."""
        self._update_shared()
        self._update_accepted()

    def publish_directory(self) -> None:
        """Send the directory if it has changed.

        An accepted topic is listed only once a local subscriber is connected, so that the first messages are
        not lost.
        """
        accepted = tuple(
            entry
            for entry in self.local.accepted
            if (sink := self.accepted.get(entry.name)) is not None and sink.is_wanted
        )
        directory = Directory(
            self._member,
            self._sender.instance,
            self.directory.revision,
            self.local.shared,
            accepted,
            self.local.services,
            has_parameters=bool(self._file.shared_parameters),
            sets_parameters=bool(self._file.accepted_parameters),
        )
        if directory != self.directory:
            self.directory = replace(directory, revision=directory.revision + 1)
            self._document = to_json(self.directory)
            self._put_directory()

    def send_again(self) -> None:
        """Send latched messages, results and the directory again after a link failure, and resume sending.

        Receivers ignore messages that they have already received.
        """
        for source in self.shared.values():
            for kept in source.kept():
                self._link.put(source.key, kept.body, kept.attachment)
        self._sender.is_up = True
        self._put_directory()

    # -- callbacks of the link, in any thread -----------------------------------------------------------

    def take_input(self, key: str, payload: bytes, attachment: bytes) -> None:
        """Publish another member's message, if the rules accept it. Does not block."""
        match keys.parts(key):
            case (member, "in", [_, *rest]):
                name = keys.unmangled("/".join(rest))
                sink, rule = self.accepted.get(name), self._file.accepted_topic(name)
                if sink is None or rule is None or not rule.accepts(member):
                    self._warn(f"[{member}] is not allowed to publish [{name}]", member)
                elif member in self._present():
                    sink.take(member, payload, attachment)

    def answer_directory(self, question: ZenohQuestion) -> None:
        question.answer(self._document)

    def answer_latched(self, question: ZenohQuestion) -> None:
        match keys.parts(question.key):
            case (_, "t", rest):
                source = self.shared.get(keys.unmangled("/".join(rest)))
                for kept in source.kept() if source is not None else ():
                    question.answer(kept.body, kept.attachment)

    # -- internals --------------------------------------------------------------------------------

    def _put_directory(self) -> None:
        self._link.put(keys.directory(self._member), self._document, waits=True)

    def _update_shared(self) -> None:
        wanted = {name for requests in self._requests.values() for name in requests.topics}
        now_s = time.monotonic()
        self._kept_until_s = {name: end_s for name, end_s in self._kept_until_s.items() if now_s < end_s}
        wanted.update(self._kept_until_s)
        offered = {entry.name: entry for entry in self.local.shared if entry.name in wanted}
        for name, source in list(self.shared.items()):
            if offered.get(name) != source.entry:
                del self.shared[name]
                source.close()
        self.is_waiting = False
        for name, entry in offered.items():
            rule = self._file.shared_topic(name)
            before = [self.shared.get(each) for each in outcome_topics(entry) if each in offered]
            if not all(source is not None and source.is_linked for source in before):
                self.is_waiting = True  # an action client sends its goal once it receives a status
            elif name not in self.shared and rule is not None:
                change = frame_change(entry, rule, self._member)
                source = SentTopic(
                    self._node, self._sender, entry, keys.topic(self._member, name), rule, change
                )
                self.shared[name] = source
                source.start()

    def _update_accepted(self) -> None:
        offered = {entry.name: entry for entry in self.local.accepted}
        for name, sink in list(self.accepted.items()):
            if offered.get(name) != sink.entry:
                del self.accepted[name]
                sink.close()
        for name, entry in offered.items():
            if name not in self.accepted:
                self.accepted[name] = Sink(
                    self._node, entry, self._member, "", self._node.log, self._wake, self._room
                )
