"""Options of the programs that serve bridge clients."""

from __future__ import annotations

import pytest

from pipros_bridges import serve
from pipros_bridges.serve import BridgeOptions


@pytest.mark.parametrize(("host", "shown"), [
    ("127.0.0.1", "localhost"), ("[::1]", "localhost"), ("127.0.0.2", "127.0.0.2"),
    ("robot.example", "robot.example"), ("fe80::1", "[fe80::1]"),
])  # fmt: skip
def test_a_printed_address_is_one_that_the_server_listens_at(host: str, shown: str) -> None:
    assert BridgeOptions("bridge", 0, host=host).shown_host == shown


@pytest.mark.parametrize(
    ("tool", "how"), [("pipros foxglove", "--token-file"), ("foxglove_bridge", "~token_file")]
)
def test_an_open_server_names_the_setting_that_limits_access(
    tool: str, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    serve._announce(BridgeOptions(tool, 8765, host="192.0.2.1"), 8765, None, None)
    assert f"Everyone on this network can see the system; {how} limits access." in capsys.readouterr().err
