"""`rosrun diagnostic_common_diagnostics ntp_monitor.py`: compare this machine's clock with a server's."""

from __future__ import annotations

import argparse
import math
import socket
import time

import rospy
from diagnostic_common_diagnostics.nodes.monitor import hostname, publish_all
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.diagnostics import sntp
from pipros_libraries.diagnostics.machine import BadReading, Report, ntp_failure, ntp_report

DEADLINE_S = 3.0
CHECK_S = 10.0


def offset_from(server: str, port: int = sntp.PORT, deadline_s: float = DEADLINE_S) -> float:
    """Return the server's clock minus this machine's, in seconds.

    Raises:
        OSError: the server's name cannot be resolved, or the server does not respond in time.
        BadReading: the response is invalid.
    """
    family, kind, protocol, _, address = socket.getaddrinfo(server, port, type=socket.SOCK_DGRAM)[0]
    with socket.socket(family, kind, protocol) as connection:
        connection.settimeout(deadline_s)
        connection.connect(address)
        sent_s = time.time()
        asked = sntp.question(sent_s)
        connection.send(asked)
        answer = connection.recv(1024)
        return sntp.offset_s(answer, asked, sent_s, time.time())


def check(
    server: str,
    tolerance_us: float,
    error_us: float,
    port: int = sntp.PORT,
    deadline_s: float = DEADLINE_S,
) -> Report:
    """Return the report on one server."""
    try:
        return ntp_report(offset_from(server, port, deadline_s) * 1e6, tolerance_us, error_us)
    except (OSError, BadReading, UnicodeError) as error:
        return ntp_failure(f"{server}: {error}", tolerance_us, error_us)


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    parser = argparse.ArgumentParser(
        "ntp_monitor", description="Compares this machine's clock with a server's."
    )
    parser.add_argument("server", metavar="ntp-hostname")
    parser.add_argument(
        "--offset-tolerance", type=float, default=500, help="offset in us above which to warn"
    )
    parser.add_argument(
        "--error-offset-tolerance",
        type=float,
        default=5000000,
        help="offset in us above which to report an error",
    )
    parser.add_argument(
        "--self_offset-tolerance",
        type=float,
        default=500,
        help="tolerated offset in us from this machine's own server",
    )
    parser.add_argument("--diag-hostname", help="Computer name in diagnostics output (ex: 'c1')")
    parser.add_argument(
        "--no-self-test",
        dest="self_test",
        action="store_false",
        help="do not query this machine's own server",
    )
    options = parser.parse_args(rospy.myargv()[1:])
    host = hostname()
    shown = options.diag_hostname or host
    rospy.init_node("ntp_monitor", anonymous=True)

    newest: list[tuple[str, Report]] = []
    checked_s = -math.inf

    def reports() -> list[tuple[str, Report]]:
        nonlocal newest, checked_s
        if time.monotonic() - checked_s >= CHECK_S:
            newest, checked_s = check_all(), time.monotonic()
        return newest

    def check_all() -> list[tuple[str, Report]]:
        error_us = options.error_offset_tolerance
        found = [
            (
                f"NTP offset from {shown} to {options.server}",
                check(options.server, options.offset_tolerance, error_us),
            )
        ]
        if options.self_test:
            own = check(host, options.self_offset_tolerance, error_us)
            found.append((f"NTP self-offset for {shown}", own))
        return found

    return publish_all(reports, host, 1.0)
