"""Check every act of a server's clients, and refuse acts that the policy does not allow.

An act is a published message, a service call, a change of a parameter, or the start of a launch file or
recording.

A policy can only restrict clients further: a server's other conditions, such as `--control`, are checked
first.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.publisher import Publisher
from pipros_libraries.nodes.velocities import RelayedVelocity
from pipros_server.guardian_process import POLICY_GOAL_ID_CHARACTERS
from pipros_server.policy.decisions import Act, PolicyState, decide, note_stop, read_condition, rule_for
from pipros_server.policy.model import RUNS, ActKind, ActRefused, ActRule, Condition, Policy
from pipros_server.stop_guardian import StopGuardian, key_of

_LINKS: Final = 64
"""Number of publishers of a condition's topic whose links are remembered."""


class ActGate:
    """Gate that allows or refuses the acts of all clients of a server. Thread-safe.

    Topic names are resolved as the node resolves them, so that a remapping of the server does not bypass
    the policy. Without a policy, `rule`, `preview` and `check_run` raise `ActRefused`; all other acts are
    allowed.

    Attributes:
        policy: the policy, or None.
    """

    def __init__(
        self,
        node: Node,
        policy: Policy | None = None,
        clock_s: Callable[[], float] = time.monotonic,
        state: PolicyState | None = None,
    ) -> None:
        """Store the arguments. `state` is the state of an earlier gate, whose counts remain valid.

        Raises:
            ActRefused: because of a remapping, clients could publish on the topic of a condition.
        """
        for condition in policy.conditions.values() if policy is not None else ():
            topic = node.resolve(condition.topic)
            if policy is not None and (ActKind.TOPIC, topic) in policy.rules:
                text = f"the condition {condition.name} reads {topic} after remapping"
                raise ActRefused(f"{text}, and clients may publish there", condition.place)
        self.policy = policy
        self._node = node
        self._clock_s = clock_s
        self._state = state or PolicyState()
        self._guardian = StopGuardian(node)
        self._lock = threading.Lock()
        self._is_started = False

    def start(self) -> None:
        """Subscribe to the topics of the conditions, once. The node must have been started."""
        with self._lock:
            is_first, self._is_started = not self._is_started, True
        if self.policy is None or not is_first:
            return
        for condition in self.policy.conditions.values():
            self._watch(condition)

    def close(self) -> None:
        """Let the guardian publish all pending stops and exit."""
        self._guardian.close()

    def check_topic(self, topic: str, type_name: str, md5sum: str, *, latch: bool = False) -> None:
        """Check the name and the type of a topic that a client is about to publish.

        Blocks until the guardian is ready, if the topic has a time limit.

        Raises:
            ActRefused: the policy has no rule for the topic with this type; or the topic has a time limit,
                and is latched or the guardian is not ready in time.
        """
        if self.policy is None:
            return
        rule = rule_for(self.policy, ActKind.TOPIC, self._node.resolve(topic), type_name, md5sum)
        if rule.time_limit_s is None:
            return
        if latch:  # a subscriber that connects later would receive the command without its stop
            raise ActRefused(f"{rule.name} has a time limit, so it cannot be latched", rule.place)
        self._guardian.watch(rule)

    def check_message(
        self, topic: str, message: object, type_name: str = "", md5sum: str = "", client: object = None
    ) -> None:
        """Check a message. If it is allowed, count it and start its time limit, if any.

        Args:
            client: the client that publishes; see `left`.
            message: the message, or its serialized form if its type and MD5 sum are given.

        Raises:
            ActRefused: the policy does not allow the message, or its time limit cannot be started.
        """
        self._check(ActKind.TOPIC, self._node.resolve(topic), message, type_name, md5sum, client)

    def renew_after_publishing(self, topic: str, message: object, *, has_failed: bool = False) -> None:
        """Restart a published message's time limit, because it may have waited. Do nothing for goals.

        If a stop could not be published, restart the time limit that it ended.
        """
        rule = self._topic_rule(topic)
        if rule is None or rule.time_limit_s is None or rule.cancel is not None:
            return
        self._done(rule, message, has_failed=has_failed)

    def left(self, topic: str, client: object) -> bool:
        """Stop what a client started on a topic, because the client no longer publishes it.

        Return False if the topic has no time limit, so that the policy stops nothing.
        """
        rule = self._topic_rule(topic)
        if rule is None or rule.time_limit_s is None:
            return False
        if self._guardian.left(key_of(rule), client) and rule.stop is not None:
            with self._lock:
                note_stop(rule, self._state)
        return True

    def _done(self, rule: ActRule, value: object, *, has_failed: bool = False) -> None:
        """Restart the time limit of an act, unless the act is the stop itself, and has not failed."""
        if rule.time_limit_s is None or rule.stop is None:
            return
        stop = b"".join(rule.stop._to_buffers()) if isinstance(value, bytes) else rule.stop
        if has_failed or value != stop:
            self._guardian.renew(key_of(rule))

    def _topic_rule(self, topic: str) -> ActRule | None:
        rules = {} if self.policy is None else self.policy.rules
        return rules.get((ActKind.TOPIC, self._node.resolve(topic)))

    @contextmanager
    def calling(self, service: str, request: object, type_name: str, md5sum: str) -> Iterator[None]:
        """Check a service call, then run it as the body of a `with` statement; see `check_message`.

        `service` is a global name; `request` may be serialized. A time limit starts with the call and
        restarts when the call ends, because the service may have acted only then. If there is a time limit,
        this blocks until the guardian is ready.
        """
        rule = None
        if self.policy is not None:
            rule = rule_for(self.policy, ActKind.SERVICE, service, type_name, md5sum)
            if rule.time_limit_s is not None:
                self._guardian.watch(rule)
            self._check(ActKind.SERVICE, service, request, type_name, md5sum)
        has_failed = True
        try:
            yield
            has_failed = False
        finally:
            if rule is not None:
                self._done(rule, request, has_failed=has_failed)

    def check_run(self, kind: ActKind, name: str, arguments: Mapping[str, object]) -> ActRule:
        """Check and count the start of a launch file or a recording. Return its rule.

        The caller must end the program when the rule's time limit has passed.
        """
        self._check(kind, name, arguments, "", "")
        return self.rule(kind, name)

    def rule(self, kind: ActKind, name: str, type_name: str = "", md5sum: str = "") -> ActRule:
        """Return the rule for a name.

        Raises:
            ActRefused: no rule has this name and type, or there is no policy.
        """
        return rule_for(self._required_policy(), kind, name, type_name, md5sum)

    def _required_policy(self) -> Policy:
        if self.policy is None:
            raise ActRefused("there is no policy")
        return self.policy

    def preview(self, act: Act) -> ActRule:
        """Return the rule that allows an act now, without counting the act.

        Raises:
            ActRefused: the policy does not allow the act, or the act's goal id is empty or too long.
        """
        rule = self.rule(act.kind, act.name, act.type, act.md5sum)
        _goal_id(rule, act.value)
        with self._lock:
            state = PolicyState(deepcopy(self._state.accepted), dict(self._state.readings))
        return decide(self._required_policy(), act, state, self._clock_s())

    def check_parameter(self, name: str, value: object) -> None:
        """Check a new value of a parameter; `name` is global. See `check_message`."""
        self._check(ActKind.PARAMETER, name, value, "", "")

    def check_other(self, what: str) -> None:
        """Check an act that no rule can describe: raise `ActRefused` if there is a policy."""
        if self.policy is not None:
            raise ActRefused(f"the policy does not let clients {what}")

    def advertise(
        self, topic: str, message_class: Any, *, queue_size: int = 10, latch: bool = False
    ) -> GatedPublisher:
        """Advertise a topic. The publisher checks each message. Blocks as `check_topic` does.

        Raises:
            ActRefused: see `check_topic`.
            TypeConflict: the node already publishes the topic with another type.
        """
        self.check_topic(topic, message_class._type, message_class._md5sum, latch=latch)
        publisher = self._node.advertise(topic, message_class, queue_size=queue_size, latch=latch)
        return GatedPublisher(self, topic, publisher)

    def _check(
        self, kind: ActKind, name: str, value: Any, type_name: str, md5sum: str, client: object = None
    ) -> None:
        policy = self.policy
        if policy is None:
            return
        if isinstance(value, bytes):
            value = _decoded(rule_for(policy, kind, name, type_name, md5sum).message_class, value)
        elif kind is ActKind.TOPIC:
            type_name, md5sum = value._type, value._md5sum
        rule = rule_for(policy, kind, name, type_name, md5sum)
        identity = _goal_id(rule, value)  # before the decision, because a refused act must not count
        with self._lock:
            decide(policy, Act(kind, name, value, type_name, md5sum), self._state, self._clock_s())
        if rule.time_limit_s is None or kind in RUNS:
            return
        if rule.stop is not None and value == rule.stop:
            self._guardian.disarm(key_of(rule))
        else:
            self._guardian.arm(key_of(rule), identity, client)

    def _watch(self, condition: Condition) -> None:
        links: deque[Any] = deque(maxlen=_LINKS)  # the connection headers of the last links
        last: Any = None

        def received(message: Any) -> None:
            nonlocal last
            reading = read_condition(condition, message, self._clock_s())
            header = message._connection_header
            is_first = not any(header is known for known in links)
            if is_first:
                links.append(header)
            # A latching publisher sends its last message again over a new link, which makes it no newer.
            is_repeated = is_first and header.get("latching") == "1" and message == last
            last = message
            with self._lock:
                before = self._state.readings.get(condition.name)
                if is_repeated and before is not None:
                    reading = replace(reading, received_s=before.received_s)
                self._state.readings[condition.name] = reading

        self._node.subscribe(condition.topic, condition.message_class, received, queue_size=1)


class GatedPublisher:
    """A publisher that publishes only what its gate allows. Its last velocity is a zero."""

    def __init__(self, gate: ActGate, topic: str, publisher: Publisher[Any]) -> None:
        self._gate = gate
        self._topic = topic
        self._publisher = publisher
        self._velocity = RelayedVelocity(gate._node, publisher)

    @property
    def connection_count(self) -> int:
        return self._publisher.connection_count

    def publish(self, message: object) -> None:
        """Publish a message. Raise `ActRefused` if the policy does not allow it."""
        self._gate.check_message(self._topic, message, client=self)
        self._velocity.note(message)
        try:
            self._publisher.publish(message)
        except BaseException:
            self._gate.renew_after_publishing(self._topic, message, has_failed=True)
            raise
        self._gate.renew_after_publishing(self._topic, message)

    def unregister(self) -> None:
        """Stop what the client started on the topic, and unregister the publisher."""
        if self._gate.left(self._topic, self):
            self._velocity.forget()
        else:
            self._velocity.end()
        self._publisher.unregister()


def _goal_id(rule: ActRule, value: Any) -> str:
    """Return the id by which the guardian cancels a goal with a time limit; empty for other acts."""
    if rule.cancel is None or rule.time_limit_s is None:
        return ""
    identity: str = value.goal_id.id
    most = POLICY_GOAL_ID_CHARACTERS
    if not identity:
        raise ActRefused("goal_id.id must not be empty, because it is needed to cancel the goal", rule.place)
    if len(identity) > most:
        advice = f"the limit is {most} characters"
        raise ActRefused(f"goal_id.id has {len(identity)} characters; {advice}", rule.place)
    return identity


def _decoded(message_class: Any, body: bytes) -> Any:
    """Decode a message, which must consist of exactly these bytes.

    Raises:
        ActRefused: the bytes are not exactly one such message, so subscribers could decode them differently.
    """
    try:
        message = message_class._from_bytes(body)
        is_whole = b"".join(message._to_buffers()) == body
    except PiprosError as error:
        raise ActRefused(f"not a message of the type {message_class._type}: {error}") from None
    if not is_whole:
        raise ActRefused(f"the message has bytes that do not belong to the type {message_class._type}")
    return message
