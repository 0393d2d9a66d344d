"""Zenoh sessions of members and routers. `zenoh_connecting` opens them.

Callbacks run directly in Zenoh's threads and must not block; with Zenoh's separate callback threads, a
process that exits without `close` would hang.
"""

from __future__ import annotations

import contextlib
import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from pipros.basics.errors import PiprosError
from pipros.basics.extras import missing
from pipros.basics.printable import printable
from pipros_fleet import keys
from pipros_fleet.fleet_rules import Priority
from pipros_fleet.question_pace import QuestionPace

try:
    import zenoh
except ImportError as error:
    raise missing("fleets need eclipse-zenoh", "pipros-fleet", error) from error

SLICE_S: Final = 0.1
_ANSWERS_BYTES: Final = 128 * 1024 * 1024
"""Maximum total size of the replies to a request for messages, a service call or a recorded file."""
_DOCUMENTS_BYTES: Final = 16 * 1024 * 1024
"""Maximum total size of the replies to a request for documents, which have 4 MiB each."""
_ANSWER_BYTES: Final = 500
"""Memory that a reply takes in addition to its payload."""
_PRIORITIES: Final = {
    Priority.HIGH: zenoh.Priority.INTERACTIVE_HIGH,
    Priority.NORMAL: zenoh.Priority.DATA,
    Priority.LOW: zenoh.Priority.BACKGROUND,
}

OnMessage = Callable[[str, bytes, bytes], object]
"""Function that receives the key, payload and attachment of a sample."""


class LinkFailed(PiprosError):
    """A session cannot be opened or was closed, or a request was refused."""


@dataclass(frozen=True, slots=True)
class Tls:
    """PEM files for mutual TLS: the fleet's CA certificate, and the certificate and key of this process."""

    authority: str
    certificate: str
    key: str


@dataclass(frozen=True, slots=True)
class FleetAnswer:
    """One reply to a request."""

    key: str
    payload: bytes
    attachment: bytes


class Ends(Protocol):
    """A declaration on a link, which can be withdrawn."""

    def undeclare(self) -> object: ...


class ZenohQuestion:
    """A request from another member. Answer it any number of times, then call `close`. Methods may block.

    Attributes:
        key: what is asked for.
        asker: the member that asks. With TLS, routers have verified it.
    """

    def __init__(self, query: zenoh.Query) -> None:
        self._query = query
        self._asked = str(query.key_expr)
        self.asker, self.key = keys.asker_of(self._asked)
        self.payload = query.payload.to_bytes() if query.payload is not None else b""

    def answer(self, payload: bytes, attachment: bytes = b"") -> None:
        with contextlib.suppress(zenoh.ZError):  # the link was closed
            self._query.reply(self._asked, payload, attachment=attachment or None)

    def refuse(self, reason: str) -> None:
        with contextlib.suppress(zenoh.ZError):
            self._query.reply_err(reason.encode())

    def close(self) -> None:
        self._query.drop()  # type: ignore[no-untyped-call]


class SessionLink:
    """Session of a member or router. Thread-safe."""

    def __init__(self, session: zenoh.Session, asker: str) -> None:
        """Use an open session. `asker` is the name in questions; with TLS, that of the certificate."""
        self._session = session
        self._asker = asker
        self._pace = QuestionPace()

    @property
    def is_connected(self) -> bool:
        """Whether the session is connected to a router."""
        try:
            return bool(self._session.info.routers_zid())
        except zenoh.ZError:
            return False

    def put(
        self,
        key: str,
        payload: bytes,
        attachment: bytes = b"",
        priority: Priority = Priority.NORMAL,
        *,
        waits: bool = False,
    ) -> None:
        """Send a sample, which is lost if no router is connected.

        If a link is full, the sample is dropped after `FULL_US`, or after a millisecond at a router. If
        `waits` is true, the sample instead waits up to 5 s on each link and delays other samples, so set
        this only for rare, small samples.

        Raises:
            LinkFailed: the session was closed.
        """
        control = zenoh.CongestionControl.BLOCK if waits else zenoh.CongestionControl.DROP
        try:
            self._session.put(
                key,
                payload,
                attachment=attachment or None,
                congestion_control=control,
                priority=_PRIORITIES[priority],
            )
        except zenoh.ZError as error:
            raise LinkFailed(f"cannot send: {zenoh_reason(error)}") from None

    def get(
        self,
        key: str,
        payload: bytes = b"",
        *,
        timeout_s: float,
        ended: Callable[[], bool] = lambda: False,
    ) -> list[FleetAnswer]:
        """Send a request and return all replies.

        Blocks until all members that serve `key` have replied, or for about `timeout_s`, or until the replies
        reach a limit: a member may send any number.

        Args:
            ended: polled while waiting. The wait ends when it returns True.

        Raises:
            LinkFailed: the session was closed, or the request was refused and no other reply arrived; the
                text gives the reason.
        """
        found: list[FleetAnswer] = []
        refusals: list[str] = []
        is_over = threading.Event()
        _, kind, _ = keys.parts(key) or ("", "", [])
        left = _ANSWERS_BYTES if kind in ("t", "s", "history") else _DOCUMENTS_BYTES

        def on_reply(reply: zenoh.Reply) -> None:
            nonlocal left
            if is_over.is_set() or (content := reply.ok or reply.err) is None:
                return
            left -= len(content.payload) + _ANSWER_BYTES
            if left < 0:
                is_over.set()
            elif reply.ok is not None:
                found.append(_answer_of(reply.ok))
            else:
                refusals.append(content.payload.to_bytes().decode("utf-8", "replace"))

        try:
            self._session.get(
                keys.asked(key, self._asker),
                zenoh.handlers.Callback(on_reply, drop=is_over.set, indirect=False),
                payload=payload or None,
                timeout=timeout_s,
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                congestion_control=zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.INTERACTIVE_LOW,
                express=True,
            )
        except zenoh.ZError as error:
            raise LinkFailed(f"cannot send: {zenoh_reason(error)}") from None
        waited_s = 0.0
        while not is_over.wait(SLICE_S):
            waited_s += SLICE_S
            if ended() or waited_s > timeout_s + 1:
                is_over.set()
        if refusals and not found:
            raise LinkFailed(printable(refusals[0], 2000))
        return found

    def live_keys(self, pattern: str, timeout_s: float) -> list[str]:
        """Return the keys of all matching liveliness tokens. Blocks for about `timeout_s` at most.

        Raises:
            LinkFailed: the session was closed.
        """
        found: list[str] = []
        is_over = threading.Event()

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                found.append(str(reply.ok.key_expr))

        try:
            self._session.liveliness().get(
                pattern,
                zenoh.handlers.Callback(on_reply, drop=is_over.set, indirect=False),
                timeout=timeout_s,
            )
        except zenoh.ZError as error:
            raise LinkFailed(f"cannot send: {zenoh_reason(error)}") from None
        is_over.wait(timeout_s + 1)
        return sorted(found)

    def declare_token(self, key: str) -> Ends:
        """Declare a liveliness token. It disappears with the process or its link."""
        return self._session.liveliness().declare_token(key)

    def watch_tokens(self, pattern: str, on_change: Callable[[str, bool], object]) -> Ends:
        """Call `on_change(key, is_present)` whenever a matching token appears or disappears.

        Tokens that are already present are reported, too.
        """

        def on_sample(sample: zenoh.Sample) -> None:
            on_change(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        callback = zenoh.handlers.Callback(on_sample, indirect=False)
        return self._session.liveliness().declare_subscriber(pattern, callback, history=True)

    def watch_connection(self, on_change: Callable[[bool], object]) -> Ends:
        """Call `on_change(is_connected)` whenever the connection to a router is established or lost."""

        def on_event(event: zenoh.TransportEvent) -> None:
            on_change(event.kind == zenoh.SampleKind.PUT)

        callback = zenoh.handlers.Callback(on_event, indirect=False)
        return self._session.info.declare_transport_events_listener(callback, history=False)

    def subscribe(self, pattern: str, on_message: OnMessage) -> Ends:
        """Call `on_message` with each matching sample from other sessions."""

        def on_sample(sample: zenoh.Sample) -> None:
            _keep_thread_state()
            answer = _answer_of(sample)
            on_message(answer.key, answer.payload, answer.attachment)

        callback = zenoh.handlers.Callback(on_sample, indirect=False)
        return self._session.declare_subscriber(pattern, callback, allowed_origin=zenoh.Locality.REMOTE)

    def serve(self, pattern: str, on_question: Callable[[ZenohQuestion], object]) -> Ends:
        """Call `on_question` with each matching request."""

        def on_query(query: zenoh.Query) -> None:
            _keep_thread_state()
            question = ZenohQuestion(query)
            if self._pace.allows(question.asker):
                on_question(question)
            else:
                question.close()  # a refusal would take four times as long

        callback = zenoh.handlers.Callback(on_query, indirect=False)
        return self._session.declare_queryable(keys.asked(pattern, "*"), callback)

    def close(self) -> None:
        """Close the session. May be called repeatedly."""
        with contextlib.suppress(zenoh.ZError):
            self._session.close()  # type: ignore[no-untyped-call]


_MAX_THREADS: Final = 64
_threads = threading.local()
_kept_states: list[int] = []
"""Threads whose Python state is kept. The list is limited, because a state outlives its thread."""


def _keep_thread_state() -> None:
    """Keep the calling thread's Python state after the callback returns.

    Python creates a state for a foreign thread when the thread enters Python, and deletes it when the thread
    leaves. For Zenoh's threads, this happens in each callback and takes up to 60 us, because memory is
    unmapped. Entering once without leaving keeps the state.
    """
    if not hasattr(_threads, "is_kept") and len(_kept_states) < _MAX_THREADS:
        _threads.is_kept = True
        _kept_states.append(threading.get_ident())
        ctypes.pythonapi.PyGILState_Ensure()


def _answer_of(sample: zenoh.Sample) -> FleetAnswer:
    attachment = sample.attachment
    return FleetAnswer(
        keys.asker_of(str(sample.key_expr))[1],
        sample.payload.to_bytes(),
        attachment.to_bytes() if attachment is not None else b"",
    )


def zenoh_reason(error: Exception) -> str:
    """Return Zenoh's error text without the position in its source code."""
    return printable(str(error).partition(" at /")[0].strip(), 500)
