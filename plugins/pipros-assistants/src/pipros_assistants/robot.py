"""Access to a running system for the tools: calls to the master, and messages on topics.

Each call opens new connections and closes them again: calls are rare, a permanent subscription would be a
constant load on the robot, and the master may have been restarted in between.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError, Unreachable
from pipros.basics.limits import process_limits
from pipros.msg.errors import MessageException
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.open_calls import OpenCalls
from pipros.node.start_params import is_on
from pipros_assistants.answer import ToolRefused
from pipros_assistants.limits import AssistantLimits
from pipros_libraries.pictures.drawn import Drawn, picture_of
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.definitions import TopicDefinitions
from pipros_tools.graph.raw_decoder import RawDecoder
from pipros_tools.graph.system_state import SystemState, is_below

if TYPE_CHECKING:
    from pipros_tools.health.topic_facts import TopicCheck

ASSISTANT_PICTURE_BYTES = 250 * 1024
"""Limit: size of a picture in an answer. Beyond it, the picture is encoded as JPEG, and shrunk until it
fits.
"""
ASSISTANT_PICTURE_PIXELS = 64 * 1024 * 1024
"""Limit: number of pixels in an image from the robot that is decoded to create a picture. Beyond it, the
image is refused, with its size, before it is decoded.
"""
ASSISTANT_SAMPLE_BYTES = 64 * 1024 * 1024
"""Limit: total size of the messages that one call receives. A call that reads a bag may read four times as
much. Beyond it, the call ends early, and returns the messages that it has received; for a bag, the limit is
four times as large, and the call fails with an error that suggests a shorter time.
"""
ASSISTANT_CALL_S = 60.0
"""Limit: duration of a call. Beyond it, the answer says that the call took too long."""

NAME: Final = "pipros_mcp"
MASTER_S: Final = 5.0
"""Time limit for a call to the master."""
ENDING_S: Final = 2.0
"""Maximum time to wait for nodes to shut down."""
ASKED_TOPICS: Final = 3
"""Maximum number of topics whose publishers are asked for the definition of a type."""
CLOCK_S: Final = 0.5
"""Maximum time to wait for the simulated time."""


class SampledMessage(NamedTuple):
    """An undecoded message with the wall time of its receipt (s)."""

    topic: str
    time_s: float
    raw: AnyMsg


@dataclass(frozen=True, slots=True)
class MessageSamples:
    """The messages that one call received.

    Attributes:
        received: the messages, in order of arrival.
        seconds: how long the call received messages.
        now_s: ROS time at the end of the call.
        is_full: whether the call ended because the messages reached the size limit.
    """

    received: Sequence[SampledMessage]
    seconds: float
    now_s: float
    is_full: bool


class RobotAccess:
    """Access to the ROS system to which an environment refers. Thread-safe.

    Attributes:
        limits: the limits of the server for assistants.
    """

    def __init__(
        self,
        environment: Environment,
        limits: AssistantLimits | None = None,
        wait: Callable[[], object] = lambda: None,
    ) -> None:
        """Create the access. Tools call `wait` first, which returns when the system has started."""
        self.environment = environment
        self.wait = wait
        self.limits = limits or process_limits().of(AssistantLimits)
        self._waits: set[threading.Event] = set()
        self._changed = threading.Condition()

    @contextmanager
    def client(self) -> Iterator[GraphClient]:
        """Provide a client of the master within the context.

        Raises:
            ToolRefused: the master does not answer.
        """
        try:
            with GraphClient(NAME, self.environment, timeout_s=MASTER_S) as client:
                yield client
        except Unreachable as error:
            raise ToolRefused(
                "the master does not answer; call the tool `doctor` to find the reason", str(error)
            ) from None

    def state(self, below: str = "/") -> tuple[SystemState, dict[str, str]]:
        """Return the registrations of topics and services in a namespace, and all topics' types."""
        with self.client() as client:
            ns = client.resolve(below)
            state = SystemState.from_state(client.master.get_system_state())
            types = {str(topic): str(kind) for topic, kind in client.master.get_topic_types()}
        kinds = ({name: nodes for name, nodes in kind.items() if is_below(name, ns)} for kind in state)
        return SystemState(*kinds), types

    def type_of(self, topic: str) -> tuple[str, str]:
        """Return a topic's full name and its type.

        Raises:
            ToolRefused: the topic does not exist or has no publisher, or the master does not answer.
        """
        with self.client() as client:
            name = client.resolve(topic)
            types = dict(client.master.get_topic_types())
            publishers = SystemState.from_state(client.master.get_system_state()).publishers
        if name not in types:
            raise ToolRefused("this topic does not exist; list_topics lists all topics", name, types)
        if not publishers.get(name):
            raise ToolRefused("no node publishes this topic", name)
        return name, str(types[name])

    def definition_of(self, kind: str) -> list[str]:
        """Request a type's definition from its publishers, and return its lines; empty if none sends it."""
        state, types = self.state()
        topics = [topic for topic, each in types.items() if each == kind and state.publishers.get(topic)]
        if not topics:
            return []
        loop = BackgroundLoop(f"definitions of {NAME}")
        loop.start()
        try:
            with Node(NAME, anonymous=True, environment=self.environment) as node:
                known = TopicDefinitions(node, loop, OpenCalls())
                found = (known.of_topic(each, kind, state.publishers[each]) for each in topics[:ASKED_TOPICS])
                return next((each.text.splitlines() for each in found if each is not None), [])
        finally:
            loop.stop()

    def sample(
        self,
        topics: Sequence[str],
        wait_s: float,
        is_enough: Callable[[Sequence[SampledMessage]], bool] = lambda _: False,
    ) -> MessageSamples:
        """Receive messages for `wait_s`, or until `is_enough` returns true or the size limit is reached.

        `is_enough` is called after each message, in the thread that received it.
        """
        with self.client() as client:
            client.master.get_system_state()  # fail immediately if there is no master
        received: list[SampledMessage] = []
        lock, over = threading.Lock(), threading.Event()
        left = ASSISTANT_SAMPLE_BYTES

        def take(message: AnyMsg, topic: str) -> None:
            nonlocal left
            with lock:
                left -= len(message.body)
                if over.is_set() or left < 0:
                    over.set()
                    return
                received.append(SampledMessage(topic, time.time(), message))
                if is_enough(received):
                    over.set()

        with self._counted(over), Node(NAME, anonymous=True, environment=self.environment) as node:
            began_s = time.monotonic()
            with suppress(PiprosError):  # the master was stopped
                if is_on(node, "/use_sim_time"):
                    node.use_simulated_time()
            for topic in topics:
                node.subscribe(topic, AnyMsg, take, callback_args=topic)
            over.wait(wait_s)
            seconds = time.monotonic() - began_s
            with lock:
                over.set()
            now_s = _now_s(node)
        return MessageSamples(tuple(received), seconds, now_s, left < 0)

    def check_topic(self, topic: str, wait_s: float) -> TopicCheck:
        """Return why no data arrives on a topic; see `pipros_tools.health.topic_check`."""
        from pipros_tools.health.gather_topic import gather_topic
        from pipros_tools.health.topic_check import check_topic

        with self.client() as client:
            name = client.resolve(topic)
        over = threading.Event()
        with self._counted(over):
            return check_topic(gather_topic(name, self.environment, wait_s=wait_s, over=over))

    def close(self, wait_s: float = ENDING_S) -> None:
        """End all calls that are receiving messages, and wait up to `wait_s` until their nodes are closed."""
        with self._changed:
            for each in self._waits:
                each.set()
            self._changed.wait_for(lambda: not self._waits, wait_s)

    @contextmanager
    def _counted(self, over: threading.Event) -> Iterator[None]:
        with self._changed:
            self._waits.add(over)
        try:
            yield
        finally:
            with self._changed:
                self._waits.remove(over)
                self._changed.notify_all()

    def draw(self, message: Any) -> Drawn:
        """Convert a message to a picture; see `picture_of`."""
        return picture_of(message, ASSISTANT_PICTURE_PIXELS, ASSISTANT_PICTURE_BYTES)


def decoded(samples: Sequence[SampledMessage]) -> Iterator[tuple[SampledMessage, Any]]:
    """Yield the decoded messages. Messages that do not match their definition are skipped."""
    decoder = RawDecoder()
    for each in samples:
        try:
            message = decoder.decode(each.raw)
        except (PiprosError, MessageException):
            continue
        yield each, message


def _now_s(node: Node) -> float:
    """Return ROS time. Wait briefly if a simulated clock has not started yet."""
    deadline_s = time.monotonic() + CLOCK_S
    while not node.clock.now_ns() and time.monotonic() < deadline_s:
        node.wait_for_shutdown(0.02)
    return node.clock.now_ns() / 1e9
