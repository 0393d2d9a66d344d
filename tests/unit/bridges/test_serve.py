"""Options of the programs that serve bridge clients."""

from __future__ import annotations

import pytest

from pipros.bridges.serve import BridgeOptions


@pytest.mark.parametrize(
    ("host", "shown"),
    [
        ("127.0.0.1", "localhost"),
        ("[::1]", "localhost"),
        ("127.0.0.2", "127.0.0.2"),
        ("robot.example", "robot.example"),
        ("fe80::1", "[fe80::1]"),
    ],
)
def test_a_printed_address_is_one_that_the_server_listens_at(host: str, shown: str) -> None:
    assert BridgeOptions("bridge", 0, host=host).shown_host == shown
