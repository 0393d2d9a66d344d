from __future__ import annotations

import pytest

from pipros.basics.errors import Unreachable
from pipros.net.master_client import MasterClient


@pytest.mark.parametrize(("host", "names_own_computer"), [("localhost", False), ("203.0.113.5", True)])
def test_a_master_on_another_computer_may_listen_on_its_own_only(
    monkeypatch: pytest.MonkeyPatch, host: str, names_own_computer: bool
) -> None:
    def refuse(*_: object, **__: object) -> object:
        raise Unreachable(f"http://{host}:11311/", "Connection refused")

    monkeypatch.setattr("pipros.net.master_client.RpcClient.call", refuse)
    with pytest.raises(Unreachable, match="Is roscore running there") as raised:
        MasterClient(f"http://{host}:11311/", "/me").call("getPid")
    assert ("accepts connections only from its own computer" in str(raised.value)) == names_own_computer
