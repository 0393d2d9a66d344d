"""Carries out clients' operations on a ROS node.

Servers pass in the data that they receive, and send the content of each client's outbox. `RosbridgeNode`
holds the state shared by all clients, and `RosbridgeSession` holds the state of one client.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits
from pipros.node import Node
from pipros.node.open_calls import OpenCalls
from pipros_bridges.call_turns import CallTurns, QuestionTurns
from pipros_bridges.outbox import ClientOutbox
from pipros_bridges.rosbridge.caller import RosbridgeCaller
from pipros_bridges.rosbridge.effects import (
    Advertise,
    AnswerCall,
    CallService,
    Disconnect,
    Effect,
    LeaveTopic,
    OfferService,
    Publish,
    Reply,
    TakeTopic,
    Unadvertise,
    WithdrawService,
)
from pipros_bridges.rosbridge.encoding import Encoder, fragment_frames, operation_frame
from pipros_bridges.rosbridge.filling import Filler
from pipros_bridges.rosbridge.offering import OfferedServices
from pipros_bridges.rosbridge.protocol import QUESTION_NAMES, ClientProtocol, Effects, Level, response_to
from pipros_bridges.rosbridge.publishing import SharedPublishers
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.shared_publisher import CallLater
from pipros_bridges.rosbridge.streams import TopicStream
from pipros_bridges.shared_topics import SharedTopics, check_published_type
from pipros_bridges.shares import ClientShares, ServerShares
from pipros_server.act_gate import ActGate

CALLS_AT_ONCE: Final = 64
"""Maximum number of concurrent service calls by all clients, plus one per client. Further calls wait."""
QUESTION_THREADS: Final = 4
"""Number of threads for all clients' calls to rosapi, which seldom block."""
CALLS_OF_A_CLIENT: Final = 256
"""Maximum number of running and queued calls of one client."""
SMALL_CALL_BYTES: Final = 4096
"""Minimum memory that is counted for the request of a pending call."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Timeouts of a server, in seconds.

    Attributes:
        unregister_s: how long a publisher is kept after its last client has left.
        call_s: maximum duration of a service call, whether a client is the caller or the server.
    """

    unregister_s: float = 10.0
    call_s: float = 600.0


class RosbridgeNode:
    """State that is shared by the clients of a rosbridge server."""

    def __init__(
        self,
        node: Node,
        call_later: CallLater,
        settings: RosbridgeSettings | None = None,
        timing: Timing | None = None,
        limits: Limits | None = None,
        gate: ActGate | None = None,
    ) -> None:
        """Create the state. `call_later` must not call functions in the event loop, because they may block.

        `gate` allows or refuses the clients' acts; the default gate has the policy of the settings.
        """
        timing = timing or Timing()
        self.node = node
        self.limits = limits or node.limits
        self.settings = settings or RosbridgeSettings()
        self.call_later = call_later
        self.gate = gate or ActGate(node, self.settings.policy)
        self.gate.start()
        # A client that may not change the system must not decide which type other nodes see.
        self.topics = SharedTopics(node, reports_types=self.settings.has_control)
        self.encoder = Encoder(is_bson=self.settings.is_bson)
        self.filler = Filler(lambda: node.clock.now_ns())
        self.services = OfferedServices(node, self.filler, timing.call_s)
        self.publishers = SharedPublishers(
            node, self.filler, self.topics.type_of, call_later, timing.unregister_s, self.gate
        )
        self.calls = CallTurns("service calls of a bridge", CALLS_AT_ONCE)
        self.caller = RosbridgeCaller(node, self.gate, self.filler, self.encoder, timing.call_s)
        # Calls to rosapi are short, and do not wait for other calls, which may take minutes.
        self.questions = QuestionTurns("questions of a bridge", QUESTION_THREADS)

    def connect(self, outbox: ClientOutbox, shares: ClientShares | None = None) -> RosbridgeSession:
        """Return a session for a new client. The caller must send the content of `outbox` to the client."""
        is_reader = not self.settings.has_control
        return RosbridgeSession(self, outbox, shares or ServerShares(self.limits).client(is_reader=is_reader))

    def close(self) -> None:
        """Make all calls to the clients' services fail, and ignore any further subscriptions."""
        self.gate.close()
        self.services.close()
        self.topics.close()
        self.calls.close()
        self.questions.close()
        self.caller.close()


class RosbridgeSession:
    """One client: its protocol, its outbox, and the topics and services that it uses.

    `receive` and `receive_stream` may block, and are called by one thread at a time.

    Attributes:
        outbox: data for the client.
        ended: reason for disconnecting the client; empty while it may stay connected.
        worked_s: processor time (s) that the client's messages and calls have taken so far.
    """

    def __init__(self, bridge: RosbridgeNode, outbox: ClientOutbox, shares: ClientShares) -> None:
        self.outbox = outbox
        self._shares = shares
        self.ended = ""
        self.worked_s = 0.0
        self._bridge = bridge
        self._node = bridge.node
        check_type = partial(check_published_type, bridge.node)
        self._protocol = ClientProtocol(
            bridge.settings, bridge.node.resolve, bridge.limits, shares=shares, check_type=check_type
        )
        self._streams: dict[str, TopicStream] = {}
        self._published: set[str] = set()
        self._offered: dict[str, str] = {}  # maps the names that the client uses to global names
        self._calls = OpenCalls()
        self._open_calls = 0
        self._call_turns = bridge.calls.user()
        self._is_closed = False
        self._lock = threading.Lock()
        self._carry_out: Mapping[type, Callable[[Any], None]] = {
            Reply: lambda effect: self._send(effect.operation),
            TakeTopic: self._take,
            LeaveTopic: self._leave,
            Advertise: self._advertise,
            Unadvertise: self._unadvertise,
            Publish: self._publish,
            CallService: self._call,
            OfferService: self._offer,
            WithdrawService: self._withdraw,
            AnswerCall: self._answer,
            Disconnect: self._disconnect,
        }

    def receive(self, data: str | bytes) -> None:
        """Handle a frame."""
        self._handle(self._protocol.receive(data))

    def receive_stream(self, text: str) -> None:
        """Handle a part of a stream of JSON objects."""
        self._handle(self._protocol.receive_stream(text))

    def close(self) -> None:
        """Release everything that the client uses. Callers of its services receive an error."""
        with self._lock:
            self._is_closed = True
        self._calls.interrupt()
        self._call_turns.close()
        self._bridge.questions.forget(self)
        while self._streams:  # streams refer to the session; without this cycle, each is freed at once
            self._streams.popitem()[1].close()
        for service in list(self._offered.values()):
            self._bridge.services.withdraw(self, service)
        for topic in list(self._published):
            self._bridge.publishers.release(self, topic)
        self.outbox.close()

    @property
    def incomplete_bytes(self) -> int:
        """Memory of the incomplete text at the end of a stream."""
        return self._protocol.incomplete_bytes

    @property
    def is_logged_in(self) -> bool:
        """Whether the client has authenticated, or no authentication is required."""
        return self._protocol.is_authenticated

    @property
    def is_unused(self) -> bool:
        """Whether the client has no subscriptions, publications, services or pending calls."""
        return not (self._streams or self._published or self._offered or self._open_calls)

    @property
    def topics(self) -> list[str]:
        """The topics to which the client subscribes, by the names that the client uses."""
        return list(self._streams)

    @property
    def published(self) -> list[str]:
        """The topics that the client publishes."""
        return sorted(self._published)

    def send_call(self, operation: Mapping[str, Any], request: Any) -> None:
        """Send the client a call to a service that it offers, with the request's values."""
        self._send({**operation, "args": self._bridge.encoder.values_of(request)})

    def _handle(self, effects: Effects) -> None:
        began_s = time.thread_time()
        try:
            self._carry_out_all(effects)
        finally:
            self._count_work(began_s)

    def _count_work(self, began_s: float) -> None:
        with self._lock:
            self.worked_s += time.thread_time() - began_s

    def _carry_out_all(self, effects: Effects) -> None:
        failure: PiprosError | None = None
        with suppress(StopIteration):
            while not (self.ended or self._is_closed):
                failure = self._failure_of(next(effects) if failure is None else effects.throw(failure))
        self._protocol.end_message()
        if self._is_closed:  # `close` may have run before this thread finished
            self.close()

    def _failure_of(self, effect: Effect) -> PiprosError | None:
        """Carry out an effect, and return why it failed."""
        try:
            self._carry_out[type(effect)](effect)
        except PiprosError as error:
            return error
        except Exception as error:
            self._node.log.exception("unexpected error in a client's operation")
            return PiprosError(str(error) or type(error).__name__)
        return None

    def report(self, text: str, operation: Mapping[str, Any] | None = None) -> None:
        """Send an error as a status message. Thread-safe."""
        for reply in self._protocol.status(Level.ERROR, text, operation):
            self._send(reply.operation)

    def _send(self, operation: Mapping[str, Any], fragment_size: int = 0) -> None:
        frame = operation_frame(operation, is_bson=self._bridge.settings.is_bson)
        self.outbox.answer(*fragment_frames(frame, fragment_size))

    # -- topics -----------------------------------------------------------------------------

    def _take(self, effect: TakeTopic) -> None:
        if self.outbox.is_closed:  # the last operations of a client that has left are still carried out
            return
        bridge, topic = self._bridge, effect.topic
        found = self._streams.get(topic)
        stream = found or TopicStream(
            topic, bridge.topics, bridge.encoder, self.outbox, self.report, bridge.call_later, self
        )
        self._streams[topic] = stream
        bridge.topics.wait_for_turn(self)
        try:
            stream.take(effect.kind, effect.delivery)
        except PiprosError:
            if found is None:
                self._leave(LeaveTopic(topic))
            raise

    def _leave(self, effect: LeaveTopic) -> None:
        stream = self._streams.pop(effect.topic, None)
        if stream is not None:
            stream.close()

    def _advertise(self, effect: Advertise) -> None:
        topic = self._node.resolve(effect.topic)
        self._bridge.publishers.advertise(
            self, topic, effect.kind, latch=effect.latch, queue_size=effect.queue_size, shares=self._shares
        )
        self._published.add(topic)

    def _unadvertise(self, effect: Unadvertise) -> None:
        topic = self._node.resolve(effect.topic)
        self._published.discard(topic)
        self._bridge.publishers.release(self, topic)

    def _publish(self, effect: Publish) -> None:
        topic = self._node.resolve(effect.topic)
        try:
            self._bridge.publishers.publish(
                self,
                topic,
                effect.values,
                latch=effect.latch,
                queue_size=effect.queue_size,
                shares=self._shares,
                end_parsing=self._protocol.end_message,
            )
        except PiprosError:
            if topic not in self._published:
                self._bridge.publishers.release(self, topic)
            raise
        self._published.add(topic)

    # -- services ---------------------------------------------------------------------------

    def _call(self, effect: CallService) -> None:
        is_question = effect.service in QUESTION_NAMES
        if is_question and self.outbox.is_closed:
            return
        with self._lock:
            if self._open_calls >= CALLS_OF_A_CLIENT:
                raise PiprosError(
                    f"{CALLS_OF_A_CLIENT} calls from this client are pending; wait until one ends"
                )
            size_bytes = max(self._protocol.parsed_bytes, SMALL_CALL_BYTES)
            if not self._shares.calls.take(size_bytes):
                raise PiprosError("pending calls from this client need too much memory; wait until one ends")
            self._open_calls += 1
        call = partial(self._call_now, effect, size_bytes)
        if is_question:
            self._bridge.questions.run(self, call)
        else:
            self._call_turns.run(call)

    def _call_now(self, effect: CallService, size_bytes: int) -> None:
        """Call a service and send the response. Runs in a separate thread."""
        began_s = time.thread_time()
        try:
            values, is_success = self._bridge.caller.call(effect, self._calls), True
        except Exception as error:
            values, is_success = str(error) or type(error).__name__, False
        finally:
            with self._lock:
                self._open_calls -= 1
                self._shares.calls.give_back(size_bytes)
        if not self._is_closed:
            response = response_to(effect.operation, values, is_success=is_success)
            try:
                self._send(response, effect.fragment_size)
            except PiprosError as error:
                self._send(response_to(effect.operation, str(error), is_success=False))
        self._count_work(began_s)

    def _offer(self, effect: OfferService) -> None:
        self._bridge.gate.check_other("offer services")
        service = self._node.resolve(effect.service)
        self._bridge.services.offer(self, service, effect.kind, effect.service)
        self._offered[effect.service] = service

    def _withdraw(self, effect: WithdrawService) -> None:
        service = self._offered.pop(effect.service, None)
        if service is not None:
            self._bridge.services.withdraw(self, service)

    def _answer(self, effect: AnswerCall) -> None:
        service = self._node.resolve(effect.service)
        self._bridge.services.answer(self, service, effect.call, effect.values, is_success=effect.is_success)

    def _disconnect(self, effect: Disconnect) -> None:
        self.ended = effect.reason
