"""Zenoh sessions of members and routers.

All connection settings are explicit, because Zenoh's defaults change between minor versions. Callbacks run
directly in Zenoh's threads and must not block; with Zenoh's separate callback threads, a process that exits
without `close` would hang. Shared memory is disabled, because a killed process would leave segments behind.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

from pipros.basics.errors import PiprosError
from pipros.basics.extras import missing
from pipros.basics.limits import Limits, process_limits
from pipros.basics.printable import printable
from pipros.fleet.fleet_file import Priority
from pipros.fleet.limits import FleetLimits
from pipros.net.connect import Connector
from pipros.net.rpc_client import reason_of

try:
    import zenoh
except ImportError as error:
    raise missing("fleets need eclipse-zenoh", "fleet", error) from error

LEASE_MS: Final = 4000
"""Time without data after which a link is closed. Each side sends at least four keep-alives in that time."""
TCP_S: Final = 15.0
"""Timeout for the TCP connection that measures the round-trip time to the router before a session is opened.
Three lost packets delay it by seven seconds.
"""
CONNECT_S: Final = 1.0
CONNECT_ROUND_TRIPS: Final = 15
"""Timeout for Zenoh's handshake with the router: `CONNECT_S` and this many round trips. The handshake takes
three round trips, or four with TLS, and as much again for each packet that is lost.
"""
RETRY: Final = {"period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 2}
"""Pauses between attempts: a member reconnects within a second of its router's start."""
FULL_US: Final = 20_000
"""Time that a member waits for room on a full link before dropping a message. Routers wait only a
millisecond, so that a slow member hardly delays other members.
"""
SESSIONS: Final = 2000
"""Maximum number of a router's links, and of links being accepted."""
SMALLEST_BUFFER_BYTES: Final = 16 * 1024
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
    """A request from another member. Answer it any number of times, then call `close`. Methods may block."""

    def __init__(self, query: zenoh.Query) -> None:
        self._query = query
        self.key = str(query.key_expr)
        self.payload = query.payload.to_bytes() if query.payload is not None else b""

    def answer(self, payload: bytes, attachment: bytes = b"", key: str = "") -> None:
        with contextlib.suppress(zenoh.ZError):  # the link was closed
            self._query.reply(key or self.key, payload, attachment=attachment or None)

    def refuse(self, reason: str) -> None:
        with contextlib.suppress(zenoh.ZError):
            self._query.reply_err(reason.encode())

    def close(self) -> None:
        self._query.drop()  # type: ignore[no-untyped-call]


class SessionLink:
    """Session of a member or router. Thread-safe."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session

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
            raise LinkFailed(f"cannot send: {_reason(error)}") from None

    def get(
        self,
        key: str,
        payload: bytes = b"",
        *,
        timeout_s: float,
        ended: Callable[[], bool] = lambda: False,
    ) -> list[FleetAnswer]:
        """Send a request and return all replies.

        Blocks until all members that serve `key` have replied, or for about `timeout_s`.

        Args:
            ended: polled while waiting. The wait ends when it returns True.

        Raises:
            LinkFailed: the session was closed, or the request was refused and no other reply arrived; the
                text gives the reason.
        """
        found: list[FleetAnswer] = []
        refusals: list[str] = []
        is_over = threading.Event()

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                found.append(_answer_of(reply.ok))
            elif reply.err is not None:
                refusals.append(reply.err.payload.to_bytes().decode("utf-8", "replace"))

        try:
            self._session.get(
                key,
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
            raise LinkFailed(f"cannot send: {_reason(error)}") from None
        waited_s = 0.0
        while not is_over.wait(_SLICE_S):
            waited_s += _SLICE_S
            if ended() or waited_s > timeout_s + 1:
                break
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
            raise LinkFailed(f"cannot send: {_reason(error)}") from None
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
            on_question(ZenohQuestion(query))

        callback = zenoh.handlers.Callback(on_query, indirect=False)
        return self._session.declare_queryable(pattern, callback)

    def close(self) -> None:
        """Close the session. May be called repeatedly."""
        with contextlib.suppress(zenoh.ZError):
            self._session.close()  # type: ignore[no-untyped-call]


_SLICE_S: Final = 0.1

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
        str(sample.key_expr),
        sample.payload.to_bytes(),
        attachment.to_bytes() if attachment is not None else b"",
    )


def connect(
    router: str,
    tls: Tls | None = None,
    *,
    limits: Limits | None = None,
    bandwidth_kbit: float = 0.0,
) -> SessionLink:
    """Connect to a router. The link reconnects whenever it is lost.

    Blocks for at most about a second if the router is near or refuses the connection, and otherwise for up to
    `TCP_S`, then `CONNECT_S` and 15 round trips. A signal handler that raises ends the wait.

    Args:
        bandwidth_kbit: the bandwidth in the member's file. The operating system's send buffer is limited to
            50 ms of data at this bandwidth, but to no less than SMALLEST_BUFFER_BYTES.

    Raises:
        LinkFailed: the router does not answer in time, or refuses the connection.
    """
    checked_address(router)
    round_trip_s = _round_trip_s(router)
    limit_s = CONNECT_S + CONNECT_ROUND_TRIPS * round_trip_s
    settings: dict[str, object] = {
        "connect/endpoints": [router],
        "connect/timeout_ms": int(1000 * limit_s),
        "connect/exit_on_failure": True,
        "connect/retry": RETRY,
        "listen/endpoints": [],
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": FULL_US,
    }
    if bandwidth_kbit:
        buffer_bytes = max(SMALLEST_BUFFER_BYTES, int(bandwidth_kbit * 1000 / 8 / 20))
        settings["transport/link/tcp/so_sndbuf"] = buffer_bytes
        settings["transport/link/tls/so_sndbuf"] = buffer_bytes
    if tls is not None:
        settings |= {
            "transport/link/tls/root_ca_certificate": tls.authority,
            "transport/link/tls/connect_certificate": tls.certificate,
            "transport/link/tls/connect_private_key": tls.key,
            "transport/link/tls/enable_mtls": True,
            "transport/link/tls/verify_name_on_connect": False,
        }
    try:
        return SessionLink(_open(_config("client", settings, limits or process_limits())))
    except zenoh.ZError as error:
        waited = f"waited {limit_s:.1f} s for the handshake, after a TCP connection in {round_trip_s:.2f} s"
        raise LinkFailed(f"cannot reach the router at {router}: {_reason(error)} ({waited})") from None


def _round_trip_s(router: str) -> float:
    """Return the time that a TCP connection to a router takes: one round trip.

    Raises:
        LinkFailed: the connection fails, or is not established within `TCP_S`.
    """
    host, _, port = router.partition("/")[2].rpartition(":")
    began = time.monotonic()
    try:
        Connector().connect(host.strip("[]"), int(port), began + TCP_S).close()
    except TimeoutError:
        raise LinkFailed(
            f"cannot reach the router at {router}: no TCP connection within {TCP_S:g} s"
        ) from None
    except OSError as error:
        raise LinkFailed(f"cannot reach the router at {router}: {reason_of(error)}") from None
    return time.monotonic() - began


def _open(config: zenoh.Config) -> zenoh.Session:
    """Open a session in a thread, because Python handles no signals while Zenoh waits."""
    sessions: list[zenoh.Session] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            sessions.append(zenoh.open(config))
        except BaseException as error:
            errors.append(error)

    opening = threading.Thread(target=work, name="zenoh open", daemon=True)
    opening.start()
    while opening.is_alive():
        opening.join(_SLICE_S)
    if errors:
        raise errors[0]
    return sessions[0]


def open_router(
    addresses: Sequence[str],
    tls: Tls | None = None,
    access: Mapping[str, object] | None = None,
    *,
    others: Sequence[str] = (),
    limits: Limits | None = None,
) -> SessionLink:
    """Start a router.

    Args:
        addresses: addresses to listen on.
        access: rules of Zenoh's access control; None permits everything to everyone.
        others: addresses of routers to connect to.

    Raises:
        LinkFailed: the router cannot listen on an address, or a file cannot be read.
    """
    settings: dict[str, object] = {
        "listen/endpoints": [checked_address(address) for address in addresses],
        "listen/timeout_ms": 0,
        "listen/exit_on_failure": True,
        "connect/endpoints": [checked_address(address) for address in others],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": RETRY,
        "transport/unicast/max_sessions": SESSIONS,
        "transport/unicast/accept_pending": SESSIONS,
    }
    if tls is not None:
        settings |= {
            "transport/link/tls/root_ca_certificate": tls.authority,
            "transport/link/tls/listen_certificate": tls.certificate,
            "transport/link/tls/listen_private_key": tls.key,
            "transport/link/tls/connect_certificate": tls.certificate,
            "transport/link/tls/connect_private_key": tls.key,
            "transport/link/tls/enable_mtls": True,
            "transport/link/tls/verify_name_on_connect": False,
        }
    if access is not None:
        settings["access_control"] = access
    try:
        return SessionLink(zenoh.open(_config("router", settings, limits or process_limits())))
    except zenoh.ZError as error:
        raise LinkFailed(f"cannot listen at {', '.join(addresses)}: {_reason(error)}") from None


def checked_address(address: str) -> str:
    """Check that an address has the form `tcp/HOST:PORT` or `tls/HOST:PORT`, and return it.

    Raises:
        LinkFailed: the address does not have this form.
    """
    protocol, _, place = address.partition("/")
    host, _, port = place.rpartition(":")
    if protocol not in ("tcp", "tls") or not host or not port.isdecimal() or set("/?#;") & set(place):
        raise LinkFailed(
            f"an address must have the form tcp/HOST:PORT or tls/HOST:PORT, got {printable(address)}"
        )
    return address


def _config(mode: str, settings: Mapping[str, object], limits: Limits) -> zenoh.Config:
    config: Any = zenoh.Config()
    everywhere = {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        "transport/unicast/qos/enabled": True,
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/tx/keep_alive": 4,
        "transport/link/rx/max_message_size": limits.of(FleetLimits).fleet_message_bytes + _OVERHEAD_BYTES,
    }
    for key, value in {**everywhere, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return config  # type: ignore[no-any-return]


_OVERHEAD_BYTES: Final = 64 * 1024


def _reason(error: Exception) -> str:
    """Return Zenoh's error text without the position in its source code."""
    return printable(str(error).partition(" at /")[0].strip(), 500)
