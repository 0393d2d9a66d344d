"""Looking up services at their servers."""

from __future__ import annotations

import socket
from contextlib import suppress
from typing import Any, cast

import pytest

from pipros.graph import services
from pipros.net.master_client import MasterClient


def test_a_silent_address_is_called_once_by_each_thread_whatever_is_registered_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(services, "PROBE_DEADLINE_S", 0.1)
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
        silent.setblocking(False)

        class Registrations:
            caller_id = "/test"

            def get_system_state(self) -> Any:
                return [[], [], [[f"/service{number}", ["/silent"]] for number in range(100)]]

            def lookup_service(self, _: str) -> str:
                return f"rosrpc://127.0.0.1:{silent.getsockname()[1]}"

        master = cast(MasterClient, Registrations())
        assert services.services_of_type(master, "std_srvs/Empty") == []
        called = 0
        with suppress(BlockingIOError):
            while True:
                silent.accept()[0].close()
                called += 1
    assert 1 <= called <= services.ASKED_AT_ONCE
