"""A running participant: a `ParticipantCore` with sockets and two threads.

One thread reads the sockets and polls the core. It runs no callbacks, except those of services, which only
hand the sample to another thread. The other thread runs the callbacks, one at a time. `RtpsTopicWriter.write`
sends in the caller's thread.
"""

from __future__ import annotations

import contextlib
import logging
import selectors
import socket
import threading
import time
from collections.abc import Callable
from queue import SimpleQueue
from types import TracebackType
from typing import Final, Generic, TypeVar

from pipros.basics.interruptible_wait import get_within_slice
from pipros.basics.limits import Limits, process_limits
from pipros_ros2.inbox import ROS2_INBOX_BYTES
from pipros_ros2.limits import Ros2Limits
from pipros_ros2.rtps.announcements import EndpointData, ParticipantData
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.events import Event, ReceivedSample, RtpsSettings
from pipros_ros2.rtps.identity import new_prefix
from pipros_ros2.rtps.intake import Intake
from pipros_ros2.rtps.parameters import SampleIdentity
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.qos import Qos
from pipros_ros2.rtps.sockets import RtpsSockets, SocketBacklog
from pipros_ros2.rtps.topics import ParticipantClosed, RtpsTopicWriter, TopicReader
from pipros_ros2.rtps.writer_proxy import RtpsSample

DEFAULT_USER_DATA: Final = b"enclave=/;"
_Answer = TypeVar("_Answer")
_Reported = TypeVar("_Reported")
_LOG = logging.getLogger("pipros_ros2")
_SLICE_S: Final = 0.05
_BURST_PAUSE_S: Final = 0.0005
_WAKES_AT_ONCE: Final = 64
_JOIN_S: Final = 2.0


class Participant:
    """A participant in a domain, which runs until `close` is called or the `with` block ends.

    After that, `add_writer`, `add_reader` and `write` raise PiprosError.
    """

    def __init__(
        self,
        discovery: Discovery,
        user_data: bytes = DEFAULT_USER_DATA,
        on_event: Callable[[Event], None] | None = None,
        limits: Limits | None = None,
        sockets: RtpsSockets | None = None,
    ) -> None:
        """Open sockets and start looking for other participants.

        Args:
            on_event: called for all events except samples, in the callback thread.
            sockets: a replacement for tests.

        Raises:
            Unreachable: this machine has no free port in the domain.
        """
        self._limits = limits or process_limits()
        self._sockets = sockets or RtpsSockets(discovery)
        me = ParticipantData(
            new_prefix(),
            discovery=self._sockets.discovery,
            data=self._sockets.data,
            user_data=user_data,
        )
        self.prefix = me.prefix
        self.discovery = discovery
        settings = RtpsSettings(
            me,
            self._sockets.announce_to,
            self._sockets.local_hosts,
            self._sockets.request_bytes,
            self._sockets.static_hosts,
        )
        self._core = ParticipantCore(settings, self._limits, time.monotonic())
        self._on_event = on_event
        self._lock = threading.Lock()
        self._readers: dict[bytes, TopicReader] = {}
        self._direct: dict[bytes, Callable[[RtpsSample], None]] = {}
        self._calls: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._watchers: list[SimpleQueue[None]] = []
        self._is_closing = False
        self._intake = Intake(
            self._core,
            SocketBacklog(self._limits.of(Ros2Limits).ros2_backlog_bytes),
            self._sockets.receiving,
        )
        self._wake_from, self._wake_to = socket.socketpair()
        self._wake_from.setblocking(False)
        self._wake_to.setblocking(False)
        self._threads = [
            threading.Thread(target=self._run, name="rtps", daemon=True),
            threading.Thread(target=self._call_back, name="rtps callbacks", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> Participant:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def add_writer(self, topic: str, type_name: str, qos: Qos, user_data: bytes = b"") -> RtpsTopicWriter:
        """Create a writer and announce it to the peers. `topic` and `type_name` are DDS names."""
        with self._lock:
            entity = self._open_core().add_writer(topic, type_name, qos, time.monotonic(), user_data)
            self._flush()
        return RtpsTopicWriter(self, entity)

    def add_reader(
        self,
        topic: str,
        type_name: str,
        qos: Qos,
        callback: Callable[[RtpsSample], None],
        user_data: bytes = b"",
        *,
        is_direct: bool = False,
    ) -> TopicReader:
        """Create a reader and announce it to the peers. `topic` and `type_name` are DDS names.

        Args:
            callback: called for each sample. Up to `qos.depth` samples (0: no limit) wait for it, within
                `ROS2_INBOX_BYTES`; beyond that, the oldest ones are dropped.
            is_direct: run the callback in the thread that reads the sockets; it must not block.
        """
        reader = TopicReader(self, callback, qos.depth, ROS2_INBOX_BYTES)
        with self._lock:
            entity = self._open_core().add_reader(topic, type_name, qos, time.monotonic(), user_data)
            reader.entity = entity
            if is_direct:
                self._direct[entity] = callback
            else:
                self._readers[entity] = reader
            self._flush()
        return reader

    def _open_core(self) -> ParticipantCore:
        if self._is_closing:
            raise ParticipantClosed("the ROS 2 participant is closed")
        return self._core

    def write(
        self,
        entity: bytes,
        payload: bytes,
        related: SampleIdentity | None,
        recipients: frozenset[bytes] | None,
        registered: Callable[[int], None] | None = None,
    ) -> int:
        """Send a sample; see `RtpsTopicWriter.write`.

        Args:
            registered: called with the sequence number before any reply can arrive.
        """
        with self._lock:
            now = time.monotonic()
            number = self._open_core().write(entity, payload, now, related, recipients, time.time_ns())
            if registered is not None:
                registered(number)
            self._flush()
        return number

    def remove(self, entity: bytes) -> None:
        """Remove a writer or reader, and notify the peers. May be called repeatedly, and after `close`."""
        with self._lock:
            self._readers.pop(entity, None)
            self._direct.pop(entity, None)
            if not self._is_closing:
                self._core.remove(entity, time.monotonic())
                self._flush()

    def ask(self, question: Callable[[ParticipantCore], _Answer]) -> _Answer:
        """Call a function with the core, under the lock, and return its result. The call must not block."""
        with self._lock:
            return question(self._core)

    def endpoints(self) -> list[EndpointData]:
        """Return all remote endpoints."""
        return self.ask(lambda core: [each for peer in core.peers for each in peer.endpoints.values()])

    def wait_for(self, condition: Callable[[ParticipantCore], bool], timeout_s: float) -> bool:
        """Wait until a condition holds; return False after the timeout, or if the participant is closed."""
        if self.ask(condition):
            return True
        deadline = time.monotonic() + timeout_s
        changes: SimpleQueue[None] = SimpleQueue()
        self._watchers.append(changes)
        try:
            while (left_s := deadline - time.monotonic()) > 0 and not self._is_closing:
                get_within_slice(changes, min(left_s, _SLICE_S))
                if self.ask(condition):
                    return True
        finally:
            self._watchers.remove(changes)
        return False

    def close(self) -> None:
        """Notify the peers that the participant is leaving, and stop the threads.

        Waits up to two seconds per thread for a running callback. May be called repeatedly.
        """
        with self._lock:
            if self._is_closing:
                return
            self._is_closing = True
            self._core.close()
            self._sockets.send(self._core.take_outgoing())
        self._wake()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(_JOIN_S)
        self._sockets.close()
        self._wake_from.close()
        self._wake_to.close()

    @property
    def failures(self) -> int:
        """Number of datagrams that revealed a bug in the core."""
        return self._intake.failures

    def _wake(self) -> None:
        with contextlib.suppress(OSError):  # the thread is awake already, or has ended
            self._wake_to.send(b"\0")

    def _flush(self) -> None:
        """Send the datagrams that are due. The caller holds the lock."""
        core = self._core
        now = time.monotonic()
        if core.has_transfers:
            core.poll(now, self._intake.handled_until)
            self._wake()
        self._sockets.send(core.take_outgoing())
        self._dispatch(core.take_events())

    def _run(self) -> None:
        selector = selectors.DefaultSelector()
        for each in (*self._sockets.receiving, self._wake_from):
            selector.register(each, selectors.EVENT_READ)
        due = 0.0
        with selector:
            while not self._is_closing:
                left_s = 0.0 if self._intake else due - time.monotonic()
                if 0 < left_s <= 0.001:  # selectors round up to a millisecond
                    time.sleep(min(left_s, _BURST_PAUSE_S))
                    left_s = 0
                ready = selector.select(max(0, min(left_s, _SLICE_S)))
                due = self._step(has_arrived=bool(ready))

    def _step(self, *, has_arrived: bool) -> float:
        """Handle datagrams and poll the core; return the deadline of its next poll."""
        if has_arrived:
            with contextlib.suppress(OSError):
                self._wake_from.recv(_WAKES_AT_ONCE)
        self._intake.read(time.monotonic())
        with self._lock:
            core = self._core
            self._intake.handle()
            core.poll(time.monotonic(), self._intake.handled_until)
            self._sockets.send(core.take_outgoing())
            events = core.take_events()
            watchers = list(self._watchers)
            due = core.deadline
            self._dispatch(events)
        if events or has_arrived:
            for watcher in watchers:
                watcher.put(None)
        return due

    def _dispatch(self, events: list[Event]) -> None:
        for event in events:
            if not isinstance(event, ReceivedSample):
                if self._on_event is not None:
                    self._calls.put(_Report(self._on_event, event))
            elif (direct := self._direct.get(event.entity)) is not None:
                _Report(direct, event.sample)()  # an exception must not end the thread that reads the sockets
            elif (reader := self._readers.get(event.entity)) is not None and reader.push(event.sample):
                self._calls.put(reader.call_back)

    def _call_back(self) -> None:
        while not self._is_closing:
            call = get_within_slice(self._calls)
            if call is not None:
                call()


class _Report(Generic[_Reported]):
    """Passes an event or a sample to a callback, and logs its exceptions."""

    __slots__ = ("_callback", "_reported")

    def __init__(self, callback: Callable[[_Reported], None], reported: _Reported) -> None:
        self._callback = callback
        self._reported = reported

    def __call__(self) -> None:
        try:
            self._callback(self._reported)
        except ParticipantClosed:
            return
        except Exception:
            _LOG.exception("a callback for ROS 2 failed")
