"""The agent of one member: a node beside its master, and a link to the router.

One thread owns the state and handles events: tokens, directories and wishes of other members, and looks at
the local master, which another thread takes because they may block. Messages do not pass through either.
"""

from __future__ import annotations

import itertools
import json
import logging
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.limits import limit_text
from pipros.bridges.foxglove.definitions import Definitions
from pipros.fleet import keys
from pipros.fleet.calls import LocalCalls
from pipros.fleet.directory import (
    Directory,
    Wishes,
    from_json,
    to_json,
    wishes_from_json,
    wishes_to_json,
)
from pipros.fleet.fleet_file import FleetFile, matches_any
from pipros.fleet.frames import frame_change
from pipros.fleet.link_status import LinkDiagnostics, Traffic, link_statuses
from pipros.fleet.local_graph import LocalGraph, look, occupied, outcome_topics, read_state
from pipros.fleet.members import Members, Token
from pipros.fleet.shown_member import ShownMember
from pipros.fleet.sinks import Sink
from pipros.fleet.sources import Sender, Source
from pipros.fleet.zenoh_session import Ends, Link, LinkFailed, Question
from pipros.graph.services import header_at, uri_of
from pipros.graph.system_state import FLEET_AGENT_PREFIX, SystemState
from pipros.msg import load_service_class
from pipros.net.loop import BackgroundLoop
from pipros.net.workers import Workers
from pipros.node import Node
from pipros.node.service_client import OpenCalls

LOOK_S: Final = 0.5
"""Interval of looks at the local master, and at the link."""
DIAGNOSTICS_S: Final = 1.0
"""Interval of messages on /diagnostics."""
LINKING_S: Final = 0.02
"""Interval of looks at sources that others wait for."""
LEAVE_S: Final = 0.2
"""Time after the end of a token by which it is known whether it was the link that ended."""
RETURN_S: Final = 3.0
"""Time that members have to connect to a router that was restarted, before they are considered gone."""
REQUEST_S: Final = 3.0
"""Time for another member to send its directory, its wishes or a definition."""


class NameTaken(PiprosError):
    """Another member has the same name."""


def agent_node_name(member: str) -> str:
    """Return the name of the node of a member's agent."""
    return FLEET_AGENT_PREFIX[1:] + member


def new_instance() -> str:
    """Return an id for one run of an agent. Later ones sort after earlier ones."""
    return f"{int(time.time()) & 0xFFFFFFFF:08x}{os.urandom(4).hex()}"


class Agent:
    """Joins a master to a fleet. Call `start` and `close`; the node and the link belong to the caller."""

    def __init__(
        self,
        node: Node,
        link: Link,
        member: str,
        file: FleetFile,
        *,
        log: logging.Logger | None = None,
        on_failure: Callable[[PiprosError], object] = lambda _: None,
        look_s: float = LOOK_S,
    ) -> None:
        """Store the settings.

        Args:
            on_failure: called when the agent must end, because an older member has its name.
            look_s: interval of looks at the local master.
        """
        self.member = keys.member_name(member)
        self.instance = new_instance()
        self.file = file
        self.log = log or node.log
        self.sender = Sender(link, self.instance, node.limits, file.bandwidth_kbit)
        self.calls = LocalCalls(node, file, self.log)
        self.shown: dict[str, ShownMember] = {}
        self._node = node
        self._link = link
        self._on_failure = on_failure
        self._look_s = look_s
        self._members = Members(node.limits.fleet_members)
        self._local = LocalGraph(SystemState({}, {}, {}))
        self._directory = Directory(self.member, self.instance)
        self._shared: dict[str, Source] = {}
        self._accepted: dict[str, Sink] = {}
        self._wishes: dict[str, Wishes] = {}
        self._wishes_sent: dict[str, Wishes] = {}
        self._revisions = itertools.count(1)
        self._asked: OpenCalls = OpenCalls()
        self._loop = BackgroundLoop(f"definitions of {node.name}")
        self._definitions = Definitions(node, self._loop, self._asked)
        self._services: dict[tuple[str, tuple[str, ...]], tuple[str, str]] = {}
        self._workers = Workers("requests of a fleet agent", 8)
        self._events: OrderedDict[tuple[str, str], Callable[[], object]] = OrderedDict()
        self._changed = threading.Condition()
        self._is_closed = threading.Event()
        self._declared: list[Ends] = []
        self._reported: set[str] = set()
        self._diagnostics: LinkDiagnostics | None = None
        self._diagnosed_s = 0.0
        self._received_before: dict[str, Traffic] = {}
        self._leaving: dict[str, float] = {}
        self._is_waiting = False
        self._away: set[str] = set()
        self._was_connected = False
        self._prune_at_s: float | None = None
        self._threads: list[threading.Thread] = []

    # -- life ---------------------------------------------------------------------

    def start(self) -> None:
        """Join the fleet. Blocks until it is known whether the name is free.

        Raises:
            NameTaken: another member has the name.
            LinkFailed: the link was closed.
        """
        mine = self._link.live_keys(keys.live(self.member), REQUEST_S)
        if mine:
            raise NameTaken(_taken(self.member))
        me = self.member
        self._loop.start()
        self._declared = [
            self._link.serve(keys.directory(me), self._on_directory_request),
            self._link.serve(keys.wanted(me, "*"), self._on_wishes_request),
            self._link.serve(keys.topic(me, keys.EVERY), self._on_latched_request),
            self._link.serve(keys.service(me, "*", keys.EVERY), self.calls.take),
            self._link.serve(keys.parameters(me, "get", "*"), self.calls.take),
            self._link.serve(keys.parameters(me, "set", "*"), self.calls.take),
            self._link.serve(keys.definition(me, "*"), self._on_definition_request),
            self._link.serve(keys.statistics(me), self._on_statistics_request),
            self._link.subscribe(keys.into("*", me, keys.EVERY), self._on_input),
            self._link.subscribe(keys.wanted("*", me), self._on_document),
            *(
                self._link.subscribe(keys.directory(pattern), self._on_document)
                for pattern in map(keys.pattern_of, self.file.show)
            ),
            self._link.declare_token(keys.live(me, keys.VERSION, self.instance)),
            self._link.watch_tokens(keys.live("*"), self._on_token),
            self._link.watch_connection(self._on_connection),
        ]
        trigger: Any = load_service_class("std_srvs/Trigger")

        def tell(_: object) -> Any:
            return trigger._response_class(self._link.is_connected, f"member {me}")

        self._node.serve(f"{self._node.name}/link", trigger, tell)  # for `pipros doctor`
        self._diagnostics = LinkDiagnostics(self._node)
        for target in (self._look_repeatedly, self._handle_events):
            thread = threading.Thread(target=target, name=f"agent {me}", daemon=True)
            thread.start()
            self._threads.append(thread)

    def close(self) -> None:
        """Leave the fleet. The topics of others are unregistered with the node."""
        self._is_closed.set()
        with self._changed:
            self._changed.notify_all()
        self._asked.interrupt()
        self.calls.close()
        self.sender.close()
        self._workers.close()
        self._loop.stop()

    # -- events from Zenoh's threads, which must not block ------------------------------

    def _post(self, kind: str, name: str, event: Callable[[], object]) -> None:
        """Have an event handled. A newer event of the same kind and name replaces one that waits."""
        with self._changed:
            self._events.pop((kind, name), None)
            if len(self._events) < 4 * self._node.limits.fleet_members:
                self._events[kind, name] = event
            self._changed.notify()

    def _on_token(self, key: str, is_present: bool) -> None:
        self._post("token", key, lambda: self._handle_token(key, is_present=is_present))

    def _on_connection(self, is_up: bool) -> None:
        if not is_up:
            self.sender.is_up = False
            self._was_connected = False
            self._post("lost", "", self._report_loss)
        self._post("tick", "", lambda: None)

    def _report_loss(self) -> None:
        self.log.warning("the link to the router is lost; local nodes are not affected")

    def _on_document(self, key: str, payload: bytes, attachment: bytes, kind: str = "") -> None:
        """Handle a directory or wishes. An answer (`kind`) may be older, so it does not replace a message."""
        del attachment
        match keys.parts(key):
            case (member, "directory", []):
                self._post(f"directory {kind}", member, lambda: self._handle_directory(member, payload))
            case (member, "wanted", [_]):
                self._post(f"wishes {kind}", member, lambda: self._handle_wishes(member, payload))

    def _on_input(self, key: str, payload: bytes, attachment: bytes) -> None:
        match keys.parts(key):
            case (member, "in", [_, *rest]):
                name = keys.unmangled("/".join(rest))
                sink, rule = self._accepted.get(name), self.file.accepted_topic(name)
                if sink is None or rule is None or not rule.accepts(member):
                    self._report(f"messages of [{member}] for [{name}] are not accepted")
                elif member in self._members.present():
                    sink.take(member, payload, attachment)

    def _on_directory_request(self, question: Question) -> None:
        question.answer(to_json(self._directory))
        question.close()

    def _on_wishes_request(self, question: Question) -> None:
        other = question.key.rpartition("/")[2]
        question.answer(wishes_to_json(self._wishes_sent.get(other, Wishes(self.instance))))
        question.close()

    def _on_latched_request(self, question: Question) -> None:
        match keys.parts(question.key):
            case (_, "t", rest):
                source = self._shared.get(keys.unmangled("/".join(rest)))
                for kept in source.latched() if source is not None else ():
                    question.answer(kept.body, kept.attachment)
        question.close()

    def _on_definition_request(self, question: Question) -> None:
        self._workers.run(self._answer_definition, question)

    def _on_statistics_request(self, question: Question) -> None:
        question.answer(json.dumps(self.statistics()).encode())
        question.close()

    # -- the thread that looks at the local master ---------------------------------------

    def _look_repeatedly(self) -> None:
        while not self._is_closed.is_set():
            found = read_state(self._node.master)
            if found is not None:
                local = look(
                    *found,
                    self.file,
                    {*self._members.present(), *self.shown},
                    self._definitions.of_topic,
                    self._service_header,
                )
                if local != self._local:
                    self._post("local", "", lambda local=local: self._handle_local(local))  # type: ignore[misc]
            self._post("tick", "", lambda: None)
            self._publish_diagnostics()
            self._is_closed.wait(self._look_s)

    def _publish_diagnostics(self) -> None:
        now_s = time.monotonic()
        if self._diagnostics is None or now_s < self._diagnosed_s + DIAGNOSTICS_S:
            return
        self._diagnosed_s = now_s
        counters = self.statistics()
        received = {name: Traffic() for name in counters["members"] if name != self.member}
        for name, (messages, _, lost, malformed) in counters["received"].items():
            sender = name.partition(" ")[0]
            if sender in received:
                before = received[sender]
                received[sender] = Traffic(
                    before.topics + 1,
                    before.messages + messages,
                    before.lost + lost,
                    before.malformed + malformed,
                )
        if self._diagnostics.is_wanted:
            self._diagnostics.publish(
                link_statuses(
                    self.member,
                    is_connected=self._link.is_connected,
                    sent=counters["sent"].values(),
                    received=received,
                    before=self._received_before,
                )
            )
        self._received_before = received

    def _service_header(self, name: str, nodes: Any) -> tuple[str, str] | None:
        key = name, tuple(nodes)
        if key not in self._services:
            try:
                uri = uri_of(self._node.master, name)
                header = header_at(uri, name, self._node.name, self._asked) if uri is not None else {}
            except PiprosError:
                return None
            if "type" not in header or "md5sum" not in header:
                return None
            if len(self._services) >= 10_000:
                self._services.clear()
            self._services[key] = header["type"], header["md5sum"]
        return self._services[key]

    # -- the thread that owns the state -----------------------------------------------------

    def _handle_events(self) -> None:
        while True:
            with self._changed:
                if not self._events and not self._is_closed.is_set():
                    self._changed.wait(LINKING_S if self._is_waiting else None)
                if self._is_closed.is_set():
                    return
                event = self._events.popitem(last=False)[1] if self._events else None
            try:
                if event is not None:
                    event()
                self._settle()
            except LinkFailed:
                return  # the session was closed
            except Exception as error:
                if not self._node.is_ending:
                    self.log.exception("the fleet agent failed: %s", error)

    def _handle_token(self, key: str, *, is_present: bool) -> None:
        if not is_present:
            self._leaving[key] = time.monotonic() + LEAVE_S
            return
        has_returned = self._leaving.pop(key, None) is not None or key in self._away
        self._away.discard(key)
        found = keys.read_live(key)
        if has_returned and found is not None and found[0] in self.shown:
            self.shown[found[0]].replay()
        token = self._members.update(key, is_present=True)
        if token is None:
            return
        if token.version != keys.VERSION:
            self._report(
                f"[{token.member}] speaks version {token.version} of the fleet protocol, this member "
                f"{keys.VERSION}; it is ignored"
            )
        elif token.member == self.member:
            older = [each for each in self._members.of(self.member) if each.instance < self.instance]
            if older:
                self._on_failure(NameTaken(_taken(self.member)))
        else:
            self._ask(token)

    def _settle_leaving(self) -> None:
        """Forget members whose tokens are gone. While the link is down, all are; then see `_prune`."""
        for key, due_s in list(self._leaving.items()):
            if not self._link.is_connected:
                del self._leaving[key]
                self._away.add(key)
            elif time.monotonic() >= due_s:
                del self._leaving[key]
                self._leave(key)

    def _leave(self, key: str) -> None:
        token = self._members.update(key, is_present=False)
        if token is None:
            return
        other = self._members.present().get(token.member)
        if other is not None:
            self._ask(other)
        else:
            self._forget(token.member)
            self.log.info("[%s] has left", token.member)

    def _prune(self) -> None:
        """Forget the members that left while the link was down. Others had time to connect again.

        Their tokens were announced again. A request for all tokens would not help, because its answers are
        incomplete in a session that watches tokens.
        """
        if self._prune_at_s is None or time.monotonic() < self._prune_at_s:
            return
        self._prune_at_s = None
        if self._link.is_connected:
            for key in self._away:
                self._leave(key)
            self._away.clear()

    def _ask(self, token: Token) -> None:
        """Request what a member may have sent before this one could receive it."""
        member = token.member
        self._workers.run(self._request, keys.wanted(member, self.member))
        if matches_any(self.file.show, member):
            self._workers.run(self._request, keys.directory(member))

    def _request(self, key: str) -> None:
        try:
            for answer in self._link.get(key, timeout_s=REQUEST_S, ended=self._is_closed.is_set):
                self._on_document(answer.key, answer.payload, answer.attachment, "answer")
        except LinkFailed as error:
            self.log.debug("%s", error)

    def _forget(self, member: str) -> None:
        self._wishes.pop(member, None)
        self._wishes_sent.pop(member, None)
        shown = self.shown.pop(member, None)
        if shown is not None:
            shown.close()

    def _handle_directory(self, member: str, payload: bytes) -> None:
        token = self._members.present().get(member)
        if member == self.member or token is None or not matches_any(self.file.show, member):
            return
        try:
            directory = from_json(payload, member, self._node.limits.fleet_directory_bytes)
        except PiprosError as error:
            self._report(str(error))
            return
        if directory.instance != token.instance:
            return
        shown = self.shown.get(member)
        if shown is not None and shown.directory.instance != directory.instance:
            self._forget(member)
            shown = None
        if shown is not None:
            if directory.revision > shown.directory.revision:
                shown.directory = directory
            return
        taken = occupied(self._local.state, member)
        if taken is not None:
            self._report(f"[{member}] is not shown, because the local name [{taken}] uses its namespace")
            return
        self.log.info("[%s] has joined", member)
        self.shown[member] = ShownMember(
            self._node, self._link, self.sender, self.member, directory, self._workers, self._wake
        )

    def _handle_wishes(self, member: str, payload: bytes) -> None:
        token, before = self._members.present().get(member), self._wishes.get(member)
        wishes = wishes_from_json(payload, self._node.limits.fleet_directory_bytes)
        if wishes is None or token is None or wishes.instance != token.instance or member == self.member:
            return
        if before is None or before.instance != wishes.instance or before.revision < wishes.revision:
            self._wishes[member] = wishes

    def _handle_local(self, local: LocalGraph) -> None:
        self._local = local
        self.calls.services = {entry.name: entry for entry in local.services}

    def _wake(self) -> None:
        self._post("tick", "", lambda: None)

    def _settle(self) -> None:
        """Bring topics, directory and wishes in line with what is known."""
        self._check_link()
        self._settle_leaving()
        self._prune()
        self._settle_shared()
        self._settle_accepted()
        room = self._node.limits.fleet_topics
        for shown in list(self.shown.values()):
            room -= shown.settle(room)
        if room <= 0:
            self._report(
                f"too many topics are shown; {limit_text('fleet_topics', self._node.limits.fleet_topics)}"
            )
        self._publish_directory()
        self._publish_wishes()

    def _check_link(self) -> None:
        is_connected = self._link.is_connected
        if is_connected == self._was_connected:
            return
        self._was_connected = is_connected
        if not is_connected:
            self.sender.is_up = False
            return
        self.log.info("connected to the router")
        self._send_latched_again()
        self.sender.is_up = True
        self._prune_at_s = time.monotonic() + RETURN_S
        for shown in self.shown.values():
            shown.replay()
        self._link.put(keys.directory(self.member), to_json(self._directory), waits=True)
        self._wishes_sent.clear()
        for token in self._members.present().values():
            if token.member != self.member:
                self._ask(token)

    def _send_latched_again(self) -> None:
        """Send what was latched while the link was down. Receivers ignore what they know."""
        for source in self._shared.values():
            for kept in source.latched():
                self._link.put(source.key, kept.body, kept.attachment)

    def _settle_shared(self) -> None:
        wanted = {name for wishes in self._wishes.values() for name in wishes.topics}
        offered = {entry.name: entry for entry in self._local.shared if entry.name in wanted}
        for name, source in list(self._shared.items()):
            if offered.get(name) != source.entry:
                del self._shared[name]
                source.close()
        self._is_waiting = False
        for name, entry in offered.items():
            rule = self.file.shared_topic(name)
            before = [self._shared.get(each) for each in outcome_topics(entry) if each in offered]
            if not all(source is not None and source.is_linked for source in before):
                self._is_waiting = True  # a client sends a goal once it has the status
            elif name not in self._shared and rule is not None:
                change = frame_change(entry, rule, self.member)
                source = Source(self._node, self.sender, entry, keys.topic(self.member, name), rule, change)
                self._shared[name] = source
                source.start()

    def _settle_accepted(self) -> None:
        offered = {entry.name: entry for entry in self._local.accepted}
        for name, sink in list(self._accepted.items()):
            if offered.get(name) != sink.entry:
                del self._accepted[name]
                sink.close()
        for name, entry in offered.items():
            if name not in self._accepted:
                self._accepted[name] = Sink(self._node, entry, self.member, "", self.log, self._wake)

    def _publish_directory(self) -> None:
        """Tell the others what this member offers. A topic is accepted once its subscribers are linked, so
        that the first message is not lost.
        """
        accepted = tuple(
            entry
            for entry in self._local.accepted
            if (sink := self._accepted.get(entry.name)) is not None and sink.is_wanted
        )
        directory = Directory(
            self.member,
            self.instance,
            self._directory.revision,
            self._local.shared,
            accepted,
            self._local.services,
            has_parameters=bool(self.file.shared_parameters),
            sets_parameters=bool(self.file.accepted_parameters),
        )
        if directory != self._directory:
            self._directory = replace(directory, revision=directory.revision + 1)
            self._link.put(keys.directory(self.member), to_json(self._directory), waits=True)

    def _publish_wishes(self) -> None:
        for member, shown in self.shown.items():
            wanted = shown.wanted()
            sent = self._wishes_sent.get(member)
            if sent is None or wanted != sent.topics:
                self._wishes_sent[member] = wishes = Wishes(self.instance, next(self._revisions), wanted)
                self._link.put(keys.wanted(self.member, member), wishes_to_json(wishes), waits=True)

    # -- other threads ---------------------------------------------------------------------

    def _answer_definition(self, question: Question) -> None:
        """Answer with the definition of a type that this member shares."""
        try:
            match keys.parts(question.key):
                case (_, "definition", [part]):
                    kind = keys.unmangled(part)[1:]
                    entry = next((each for each in self._local.shared if each.type == kind), None)
                    if entry is None:
                        return
                    nodes = self._local.state.publishers.get(entry.name, ())
                    found = self._definitions.of_topic(entry.name, kind, list(nodes))
                    if found is not None:
                        question.answer(json.dumps([found.md5sum, found.text]).encode())
        finally:
            question.close()

    def local_names(self) -> frozenset[str]:
        """Return the topics and services of the last look at the local master."""
        state = self._local.state
        return frozenset({*state.topics(), *state.services})

    def statistics(self) -> dict[str, Any]:
        """Return the counters of this member, for `pipros fleet top`."""
        return {
            "member": self.member,
            "sent": {
                source.key: [source.messages, source.bytes, source.dropped, source.unsent]
                for source in [*list(self._shared.values()), *self._sent_to_others()]
            },
            "received": {
                f"{sender} {sink.entry.name}": [each.messages, each.bytes, each.lost, each.malformed]
                for sink in [*list(self._accepted.values()), *self._received_from_others()]
                for sender, each in list(sink.received.items())
            },
            "calls": self.calls.calls,
            "refused": self.calls.refused,
            "members": sorted(self._members.present()),
        }

    def _sent_to_others(self) -> list[Source]:
        return [source for shown in list(self.shown.values()) for source in list(shown.inputs.values())]

    def _received_from_others(self) -> list[Sink]:
        return [sink for shown in list(self.shown.values()) for sink in list(shown.sinks.values())]

    def _report(self, text: str) -> None:
        """Log a warning, once."""
        if text not in self._reported and len(self._reported) < 1000:
            self._reported.add(text)
            self.log.warning(text)


def _taken(member: str) -> str:
    return (
        f"the fleet already has a member [{member}]. Choose another name, or end the other one; "
        "one whose link was cut leaves after a few seconds"
    )
