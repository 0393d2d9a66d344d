"""Open the Zenoh sessions of members and routers.

All connection settings are explicit, because Zenoh's defaults change between minor versions. Shared memory is
disabled, because a killed process would leave segments behind.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pipros.basics.limits import Limits, process_limits
from pipros.basics.printable import printable
from pipros.net.connect import Connector
from pipros.net.rpc_client import reason_of
from pipros_fleet.access import ROUTER
from pipros_fleet.limits import FleetLimits
from pipros_fleet.zenoh_session import SLICE_S, LinkFailed, SessionLink, Tls, zenoh_reason

# isort: split
import zenoh  # `zenoh_session` has found it, or raised the error that names the extra

OBSERVER: Final = "observer"
"""The asker without a name."""
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
OVERHEAD_BYTES: Final = 64 * 1024


def connect(
    router: str,
    tls: Tls | None = None,
    *,
    asker: str = OBSERVER,
    limits: Limits | None = None,
    bandwidth_kbit: float = 0.0,
) -> SessionLink:
    """Connect to a router. The link reconnects whenever it is lost.

    Blocks for at most about a second if the router is near or refuses the connection, and otherwise for up to
    `TCP_S`, then `CONNECT_S` and 15 round trips. A signal handler that raises ends the wait.

    Args:
        asker: the name to use in questions; with TLS, that of the certificate.
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
        return SessionLink(_open(_config("client", settings, limits or process_limits())), asker)
    except zenoh.ZError as error:
        waited = f"waited {limit_s:.1f} s for the handshake, after a TCP connection in {round_trip_s:.2f} s"
        raise LinkFailed(f"cannot reach the router at {router}: {zenoh_reason(error)} ({waited})") from None


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
        opening.join(SLICE_S)
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
        return SessionLink(zenoh.open(_config("router", settings, limits or process_limits())), ROUTER)
    except zenoh.ZError as error:
        raise LinkFailed(f"cannot listen at {', '.join(addresses)}: {zenoh_reason(error)}") from None


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
        "transport/link/rx/max_message_size": limits.of(FleetLimits).fleet_message_bytes + OVERHEAD_BYTES,
    }
    for key, value in {**everywhere, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return config  # type: ignore[no-any-return]
