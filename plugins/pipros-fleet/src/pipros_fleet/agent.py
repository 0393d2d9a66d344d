"""A fleet member's agent: a node on the member's master, with a link to the router.

One thread owns the state. It handles events: liveliness tokens, directories and topic requests of other
members, and changes on the local master. A second thread polls the master, because calls to it may block.
Messages pass through neither thread. The parts are `presence` (which members are present), `offers` (what
this member shares and accepts), `shown_members` (what other members offer), `calls`, `local_poller` and
`statistics`.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Callable
from contextlib import closing
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_service_class
from pipros.net.shared_workers import SharedWorkers
from pipros.node import Node
from pipros_fleet import keys
from pipros_fleet.calls import LocalCalls
from pipros_fleet.directory import FLEET_MEMBERS, FLEET_TOPICS
from pipros_fleet.events import Events
from pipros_fleet.fleet_rules import FleetFile, matches_any
from pipros_fleet.keys import AGENT_PREFIX
from pipros_fleet.local_graph import LocalGraph
from pipros_fleet.local_poller import LocalPoller
from pipros_fleet.members import TOKENS_PER_MEMBER, Token
from pipros_fleet.offers import Offers
from pipros_fleet.presence import Presence
from pipros_fleet.shown_member import ShownMember
from pipros_fleet.shown_members import ShownMembers
from pipros_fleet.sinks import SinkRoom
from pipros_fleet.sources import Sender
from pipros_fleet.statistics import Statistics
from pipros_fleet.warnings_once import WarningsOnce
from pipros_fleet.zenoh_session import Ends, LinkFailed, SessionLink, ZenohQuestion

POLL_S: Final = 0.5
"""Interval at which the local master and the link are polled."""
LINKING_S: Final = 0.02
"""Polling interval while an action's status topic waits for the action's other topics to be connected."""
REQUEST_S: Final = 3.0
"""Timeout for requests for documents."""
REQUESTS: Final = 5
"""Maximum number of requests for one document to a member that does not answer, for example if it is busy."""


class NameTaken(PiprosError):
    """Another member has the same name."""


def agent_node_name(member: str) -> str:
    """Return the node name of a member's agent."""
    return AGENT_PREFIX[1:] + member


def new_instance() -> str:
    """Return a unique ID for an agent that starts now. IDs sort by start time, with a resolution of 1 s."""
    return f"{int(time.time()) & 0xFFFFFFFF:08x}{os.urandom(4).hex()}"


class Agent:
    """An agent that connects a master to a fleet.

    Call `start` to join. To leave, call `close`, and then close the node and the link.

    Attributes:
        member: the name of this member.
        instance: unique ID, which changes whenever the agent is restarted.
        sender: sends messages to other members.
    """

    def __init__(
        self,
        node: Node,
        link: SessionLink,
        member: str,
        file: FleetFile,
        *,
        log: logging.Logger | None = None,
        on_failure: Callable[[PiprosError], object] = lambda _: None,
        poll_s: float = POLL_S,
    ) -> None:
        """Store the settings.

        Args:
            on_failure: called if this agent must stop because an older member has the same name.
            poll_s: interval at which the local master is polled.
        """
        self.member = keys.member_name(member)
        self.instance = new_instance()
        self.sender = Sender(link, self.instance, node.limits, file.bandwidth_kbit)
        self._node = node
        self._link = link
        self._file = file
        self._log = log or node.log
        self._on_failure = on_failure
        self._poll_s = poll_s
        self._warn = WarningsOnce(self._log)
        self._events = Events(4 * FLEET_MEMBERS)
        self._workers = SharedWorkers("requests of a fleet agent", 8, 4 * FLEET_TOPICS)
        self._answers = SharedWorkers("answers of a fleet agent", 8, 4 * FLEET_MEMBERS)
        self._room = SinkRoom(node.limits)
        self._presence = Presence(self.member, self.instance, FLEET_MEMBERS, self)
        self._calls = LocalCalls(node, file, self._log)
        self._poller = LocalPoller(node, self.member, file)
        wake = self._events.wake
        self._offers = Offers(
            node, link, self.sender, self.member, file, self._presence.present, self._room, self._warn, wake
        )
        self._shown = ShownMembers(
            node, link, self.sender, self.member, self._workers, self._room, self._warn, wake
        )
        self._statistics = Statistics(
            self.member, self._offers, self._shown, self._calls, lambda: iter(self._presence.present())
        )
        self._was_connected = False
        self._is_closed = threading.Event()
        self._declared: list[Ends] = []

    @property
    def shown(self) -> dict[str, ShownMember]:
        """The members whose topics and services are on the local master, by name."""
        return self._shown.members

    def statistics(self) -> dict[str, Any]:
        """Return the counters of this member, for `pipros fleet top`."""
        return self._statistics.counters()

    def local_names(self) -> frozenset[str]:
        """Return the names of the topics and services that the local master had when it was last polled."""
        state = self._offers.local.state
        return frozenset({*state.topics(), *state.services})

    def start(self) -> None:
        """Join the fleet.

        Blocks while it searches for a member with the same name and registers with the master.

        Raises:
            NameTaken: another member has the name.
            LinkFailed: the link was closed.
        """
        me, link = self.member, self._link
        if link.live_keys(keys.live(me), REQUEST_S):
            raise NameTaken(_taken(me))
        self._poller.start()
        self._declared = [
            self._serve(keys.directory(me), self._offers.answer_directory),
            self._serve(keys.wanted(me, "*"), self._shown.answer_requests),
            self._serve(keys.topic(me, keys.EVERY), self._offers.answer_latched),
            link.serve(keys.service(me, "*", keys.EVERY), self._calls.take),
            *(link.serve(keys.parameters(me, verb, "*"), self._calls.take) for verb in ("get", "set")),
            self._serve(keys.definition(me, "*"), self._answer_definition),
            self._serve(keys.statistics(me), self._statistics.answer),
            link.subscribe(keys.into("*", me, keys.EVERY), self._offers.take_input),
            link.subscribe(keys.wanted("*", me), self._on_document),
            *(
                link.subscribe(keys.directory(pattern), self._on_document)
                for pattern in map(keys.pattern_of, self._file.show)
            ),
            link.declare_token(keys.live(me, keys.VERSION, self.instance)),
            link.watch_tokens(keys.live("*"), self._on_token),
            link.watch_connection(self._on_connection),
        ]
        self._serve_link_state()
        self._statistics.advertise(self._node)
        for target in (self._poll_repeatedly, self._handle_events):
            threading.Thread(target=target, name=f"agent {me}", daemon=True).start()

    def close(self) -> None:
        """Stop the agent. The member leaves the fleet when the link is closed.

        The topics of other members stay registered on the local master until the node is closed.
        """
        self._is_closed.set()
        self._events.close()
        self._calls.close()
        self.sender.close()
        self._workers.close()
        self._answers.close()
        self._room.inflating.close()
        self._poller.close()

    def _serve_link_state(self) -> None:
        """Provide a service that reports the link's state to `pipros doctor`."""
        trigger: Any = load_service_class("std_srvs/Trigger")

        def answer(_: object) -> Any:
            return trigger._response_class(self._link.is_connected, f"member {self.member}")

        self._node.serve(f"{self._node.name}/link", trigger, answer)

    def _serve(self, key: str, answer: Callable[[ZenohQuestion], object]) -> Ends:
        """Answer requests in threads, because an answer may be large, and wait for a full link."""

        def reply(question: ZenohQuestion) -> None:
            with closing(question):
                answer(question)

        def take(question: ZenohQuestion) -> None:
            if not self._answers.run(question.asker, reply, question):
                question.refuse("too many requests are waiting")
                question.close()

        return self._link.serve(key, take)

    # -- link callbacks; they run in Zenoh's threads and must not block --------------------------------

    def _on_token(self, key: str, is_present: bool) -> None:
        def update() -> None:
            self._presence.update(key, is_present=is_present, now_s=time.monotonic())

        self._events.post("token", key, update)

    def _on_connection(self, is_up: bool) -> None:
        if not is_up:
            self.sender.is_up = False
            self._was_connected = False
            self._shown.miss()
            self._events.post("lost", "", self._report_loss)
        self._events.wake()

    def _on_document(self, key: str, payload: bytes, attachment: bytes, kind: str = "") -> None:
        """Queue a directory or topic requests for the agent's thread.

        Replies have another `kind`, so that a reply does not replace a newer document in the queue.
        """
        del attachment
        match keys.parts(key):
            case (member, "directory", []):
                self._events.post(
                    f"directory {kind}", member, lambda: self._handle_directory(member, payload)
                )
            case (member, "wanted", [_]):
                self._events.post(
                    f"requests {kind}", member, lambda: self._offers.take_requests(member, payload)
                )

    def _answer_definition(self, question: ZenohQuestion) -> None:
        self._poller.answer_definition(question, self._offers.local)

    # -- the thread that polls the local master ---------------------------------------------------

    def _poll_repeatedly(self) -> None:
        while not self._is_closed.is_set():
            local = self._poller.poll({*self._presence.present(), *self.shown})
            if local is not None and local != self._offers.local:
                self._events.post("local", "", lambda local=local: self._handle_local(local))  # type: ignore[misc]
            self._events.wake()
            self._statistics.publish(is_connected=self._link.is_connected)
            self._is_closed.wait(self._poll_s)

    # -- the thread that owns the state -----------------------------------------------------------

    def _handle_events(self) -> None:
        while True:
            event = self._events.next(LINKING_S if self._offers.is_waiting else None)
            if self._events.is_closed:
                return
            try:
                if event is not None:
                    event()
                self._update()
            except LinkFailed:
                return  # the session was closed
            except Exception as error:
                if not self._node.is_ending:
                    self._log.exception("the fleet agent failed: %s", error)

    def _update(self) -> None:
        """Update topics, directory and requested topics according to the current state."""
        self._check_link()
        self._presence.remove_departed(is_connected=self._link.is_connected, now_s=time.monotonic())
        self._offers.update()
        self._shown.update()
        self._offers.publish_directory()
        self._shown.publish_requests()

    def _check_link(self) -> None:
        is_connected = self._link.is_connected
        if is_connected == self._was_connected:
            return
        self._was_connected = is_connected
        if not is_connected:
            self.sender.is_up = False
            return
        self._log.info("connected to the router")
        self._presence.note_connection(time.monotonic())
        self._offers.send_again()
        self._shown.send_again()
        for token in self._presence.present().values():
            if token.member != self.member:
                self.on_joined(token)

    def _report_loss(self) -> None:
        self._log.warning("the link to the router is lost; local nodes are not affected")

    def _handle_local(self, local: LocalGraph) -> None:
        self._offers.local = local
        self._calls.services = {entry.name: entry for entry in local.services}

    def _handle_directory(self, member: str, payload: bytes) -> None:
        token = self._presence.present().get(member)
        if member != self.member and token is not None and matches_any(self._file.show, member):
            self._shown.take_directory(token, payload, self._offers.local.state)

    # -- members that join and leave; see `pipros_fleet.presence.PresenceListener` ----------------------

    def on_joined(self, token: Token) -> None:
        """Request the documents that the other member may have sent before this member subscribed."""
        self._workers.run(token.member, self._request, token, keys.wanted(token.member, self.member))
        if matches_any(self._file.show, token.member):
            self._workers.run(token.member, self._request, token, keys.directory(token.member))

    def on_away(self, member: str) -> None:
        self._shown.miss(member)

    def on_returned(self, member: str) -> None:
        self._shown.replay(member)

    def on_left(self, member: str) -> None:
        self._offers.forget(member)
        self._shown.forget(member)
        self._log.info("[%s] has left", member)

    def on_crowded(self, member: str) -> None:
        self._warn(f"[{member}] has too many agents; only the newest {TOKENS_PER_MEMBER} count", member)

    def on_older_namesake(self) -> None:
        self._on_failure(NameTaken(_taken(self.member)))

    def on_other_version(self, token: Token) -> None:
        self._warn(
            f"[{token.member}] is ignored: it uses version {token.version} of the fleet protocol, and this "
            f"member uses version {keys.VERSION}",
            token.member,
        )

    def _request(self, token: Token, key: str, attempts: int = REQUESTS) -> None:
        """Request a document from a member. If no reply arrives, retry after the other queued requests."""

        def is_current() -> bool:
            return self._presence.present().get(token.member) == token

        is_answered = False
        try:
            for answer in self._link.get(
                key, timeout_s=REQUEST_S, ended=lambda: self._is_closed.is_set() or not is_current()
            ):
                self._on_document(answer.key, answer.payload, answer.attachment, "answer")
                is_answered = True
        except LinkFailed as error:
            self._log.debug("%s", error)
        if not is_answered and attempts > 1 and is_current() and not self._is_closed.is_set():
            self._workers.run(token.member, self._request, token, key, attempts - 1)


def _taken(member: str) -> str:
    return (
        f"the fleet already has a member [{member}]. Choose another name, or end the other member; "
        "if its link was cut, it leaves after a few seconds"
    )
