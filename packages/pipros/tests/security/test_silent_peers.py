"""Peers that register many names at an address that accepts connections and never answers."""

from __future__ import annotations

import socket
from contextlib import suppress

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros_tools.health.gather_publisher import CALLER_ID
from pipros_tools.health.gather_system import AT_ONCE, gather_system
from tests.support.node_fixtures import master as master

NODES = 3 * AT_ONCE


def test_a_silent_address_is_examined_once_by_each_thread_whatever_is_registered_there(
    master: Master,
) -> None:
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
        silent.setblocking(False)
        api = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        for number in range(NODES):
            client = MasterClient(master.uri, f"/silent{number}")
            client.register_publisher("/topic", "std_msgs/String", api)
            client.close()
        found = gather_system(master.uri, timeout_s=0.3)
        called = 0
        with suppress(BlockingIOError):
            while True:
                connection, _ = silent.accept()
                with connection:  # the master calls the address, too
                    called += CALLER_ID.encode() in connection.recv(65_536)
    assert all(found.nodes[f"/silent{number}"].failure for number in range(NODES))
    assert 1 <= called <= AT_ONCE
