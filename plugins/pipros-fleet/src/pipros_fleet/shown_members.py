"""All other members whose topics and services appear on the local master."""

from __future__ import annotations

import itertools
from collections.abc import Callable

from pipros.basics.budget import Budget
from pipros.basics.errors import PiprosError
from pipros.basics.shares import fair_shares
from pipros.net.shared_workers import SharedWorkers
from pipros.node import Node
from pipros_fleet import keys
from pipros_fleet.directory import (
    FLEET_DIRECTORY_BYTES,
    FLEET_MEMBERS,
    FLEET_TOPICS,
    TopicRequests,
    from_json,
    requests_to_json,
)
from pipros_fleet.local_graph import occupied
from pipros_fleet.members import Token
from pipros_fleet.messages import ReceivedMessage
from pipros_fleet.shown_member import FLEET_DEFINITION_BYTES, ShownMember
from pipros_fleet.sinks import SinkRoom
from pipros_fleet.sources import Sender
from pipros_fleet.warnings_once import WarningsOnce
from pipros_fleet.zenoh_session import SessionLink, ZenohQuestion
from pipros_tools.graph.system_state import SystemState


class ShownMembers:
    """Shows other members on the local master, and sends them this member's requests.

    All methods are called by one thread, except `answer_requests`.

    Attributes:
        members: the members that are shown, by name.
    """

    def __init__(
        self,
        node: Node,
        link: SessionLink,
        sender: Sender,
        me: str,
        workers: SharedWorkers,
        room: SinkRoom,
        warn: WarningsOnce,
        wake: Callable[[], object],
    ) -> None:
        """Store the settings.

        Args:
            wake: called from any thread if `update` has work to do.
        """
        self.members: dict[str, ShownMember] = {}
        self._node = node
        self._link = link
        self._sender = sender
        self._me = me
        self._workers = workers
        self._warn = warn
        self._wake = wake
        self._definition_bytes = Budget(FLEET_DEFINITION_BYTES)
        self._room = room
        self._results: dict[str, tuple[str, dict[str, ReceivedMessage]]] = {}
        """What was received of the results of members that left, with the instances of their agents."""
        self._requests_sent: dict[str, TopicRequests] = {}
        self._revisions = itertools.count(1)

    def take_directory(self, token: Token, payload: bytes, state: SystemState) -> None:
        """Show a member, or update its directory.

        Args:
            state: state of the local master; a member whose namespace is in use there is not shown.
        """
        member = token.member
        try:
            directory = from_json(payload, member, FLEET_DIRECTORY_BYTES)
        except PiprosError as error:
            self._warn(str(error), member)
            return
        if directory.instance != token.instance:
            return
        shown = self.members.get(member)
        if shown is not None and shown.directory.instance != directory.instance:
            self.forget(member)
            shown = None
        if shown is not None:
            if directory.revision > shown.directory.revision:
                shown.directory = directory
            return
        taken = occupied(state, member)
        if taken is not None:
            self._warn(
                f"[{member}] is not shown, because the local name [{taken}] uses its namespace", member
            )
            return
        self._node.log.info("[%s] has joined", member)
        self.members[member] = ShownMember(
            self._node,
            self._link,
            self._sender,
            self._me,
            directory,
            self._workers,
            self._definition_bytes,
            self._room,
            self._wake,
        )
        instance, results = self._results.pop(member, ("", {}))
        if instance == directory.instance:
            self.members[member].results = results

    def forget(self, member: str) -> None:
        """Remove a member from the local master."""
        self._requests_sent.pop(member, None)
        shown = self.members.pop(member, None)
        if shown is not None:
            if results := shown.received_results():
                self._results[member] = shown.directory.instance, results
                while len(self._results) > FLEET_MEMBERS:
                    del self._results[next(iter(self._results))]
            shown.close()

    def miss(self, *members: str) -> None:
        """Note that results of some members, or of all, may be missed. Thread-safe."""
        for shown in [self.members[each] for each in members or tuple(self.members) if each in self.members]:
            shown.miss()

    def replay(self, member: str) -> None:
        """Request the latched messages of a member again, after its link was lost."""
        shown = self.members.get(member)
        if shown is not None:
            shown.replay()

    def send_again(self) -> None:
        """Request all latched messages again after a link failure.

        The next call of `publish_requests` sends all requests again.
        """
        for shown in self.members.values():
            shown.replay()
        self._requests_sent.clear()

    def update(self) -> None:
        """Update the local master to match the members' directories."""
        sizes = {name: shown.directory.size for name, shown in self.members.items()}
        shares = fair_shares(sizes, FLEET_TOPICS)
        for name, shown in sorted(self.members.items(), key=lambda each: shares[each[0]] >= sizes[each[0]]):
            shown.update(shares[name])  # members that must give up topics come first
            if shares[name] < sizes[name]:
                self._warn(
                    f"[{name}] offers too many topics and services; the first {shares[name]} of its "
                    f"{sizes[name]} are shown; the limit is {FLEET_TOPICS} for all members together",
                    name,
                )

    def publish_requests(self) -> None:
        """Send each member the list of its topics that local nodes want, if the list has changed."""
        for member, shown in self.members.items():
            wanted = shown.wanted()
            sent = self._requests_sent.get(member)
            if sent is None or wanted != sent.topics:
                requests = TopicRequests(self._sender.instance, next(self._revisions), wanted)
                self._requests_sent[member] = requests
                self._link.put(keys.wanted(self._me, member), requests_to_json(requests), waits=True)

    def answer_requests(self, question: ZenohQuestion) -> None:
        """Reply with the topics that this member requests from another member. Called from any thread."""
        other = question.key.rpartition("/")[2]
        sent = self._requests_sent.get(other, TopicRequests(self._sender.instance))
        question.answer(requests_to_json(sent))
