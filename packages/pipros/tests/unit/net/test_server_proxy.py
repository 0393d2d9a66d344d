"""XML-RPC proxies with a time limit."""

from __future__ import annotations

import socket

import pytest

from pipros.net.server_proxy import server_proxy


def test_calls_to_silent_servers_end_at_the_time_limit() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        proxy = server_proxy(f"http://127.0.0.1:{silent.getsockname()[1]}/", timeout_s=0.1)
        with pytest.raises(TimeoutError):
            proxy.getPid("/test")


def test_other_schemes_are_refused() -> None:
    with pytest.raises(OSError, match="must start with http://, got ftp://robot:1/"):
        server_proxy("ftp://robot:1/")
