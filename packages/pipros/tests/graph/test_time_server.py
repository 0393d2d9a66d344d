"""A time server on a socket, queried as by `ntp_monitor.py`."""

from __future__ import annotations

import socket
import struct
import threading
import time

from diagnostic_common_diagnostics.nodes import ntp_monitor
from pipros_libraries.diagnostics.items import ERROR, WARN


def test_a_server_that_is_an_hour_ahead_and_one_that_sends_garbage() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        port = server.getsockname()[1]

        def serve() -> None:
            asked, client = server.recvfrom(100)
            at = time.time() + 3600 + 2_208_988_800
            stamp = struct.pack(">II", int(at) & 0xFFFFFFFF, int((at % 1) * 2**32))
            head = struct.pack(">BB", 4 << 3 | 4, 1).ljust(24, b"\0")
            server.sendto(head + asked[40:48] + stamp + stamp, client)
            _, client = server.recvfrom(100)
            server.sendto(b"nonsense", client)

        thread = threading.Thread(target=serve)
        thread.start()
        ahead = ntp_monitor.check("127.0.0.1", 500, 1e12, port, deadline_s=30.0)
        nonsense = ntp_monitor.check("127.0.0.1", 500, 1e12, port, deadline_s=30.0)
        thread.join()

    assert (ahead.level, ahead.message) == (WARN, "NTP Offset Too High")
    assert abs(float(dict(ahead.values)["Offset (us)"]) / 1e6 - 3600) < 60
    assert nonsense.level == ERROR
    assert "must have at least 48 bytes, got 8" in nonsense.message


def test_a_missing_server_is_explained() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as closed:
        closed.bind(("127.0.0.1", 0))
        port = closed.getsockname()[1]

    report = ntp_monitor.check("127.0.0.1", 500, 5e6, port)

    assert (report.level, dict(report.values)["Offset (us)"]) == (ERROR, "N/A")
    assert ntp_monitor.check("a..b", 500, 5e6).level == ERROR
