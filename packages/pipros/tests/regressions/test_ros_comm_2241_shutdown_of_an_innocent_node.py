"""ros_comm#2241, #2067: a node died, another one got its port and was shut down instead.

The master still had the address of the dead node. When a node of the same name registered, it sent
`shutdown` to that address, which another node had meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from pipros.master.master import Master
from pipros.master.options import Probing
from pipros.net.master_client import MasterClient
from tests.support.slaves import FakeSlave
from tests.support.waiting import wait_until


@pytest.fixture
def master() -> Iterator[Master]:
    """A master that waits long for the answers of this process, which may be busy."""
    with Master(port=0, probing=Probing(answer_s=60.0)) as running:
        yield running


def register(master: Master, node: str, api: str) -> None:
    MasterClient(master.uri, node, timeout_s=10).register_publisher("/t", "x/Y", api)


def wait_until_all_is_delivered(master: Master) -> None:
    client = MasterClient(master.uri, "/test", timeout_s=10)

    def waiting() -> Any:
        return client.call("pipros.getStatistics")["notices_waiting"]

    wait_until(lambda: waiting() == 0)


@pytest.mark.parametrize("innocent_is_registered", [True, False])
def test_a_node_with_the_address_of_a_dead_node_is_left_alone(
    master: Master, innocent_is_registered: bool
) -> None:
    # A Python node returns its name; for a C++ node the master uses its registration.
    innocent, successor = FakeSlave(name="" if innocent_is_registered else "/innocent"), FakeSlave(name="/n")
    register(master, "/n", innocent.api)
    if innocent_is_registered:
        register(master, "/innocent", innocent.api)
    register(master, "/n", successor.api)
    wait_until_all_is_delivered(master)
    assert innocent.told == []
    innocent.stop()
    successor.stop()


def test_the_former_node_itself_is_shut_down(master: Master) -> None:
    former, successor = FakeSlave(name="/n"), FakeSlave(name="/n")
    register(master, "/n", former.api)
    register(master, "/n", successor.api)
    wait_until(lambda: former.told)
    assert former.told[0][0] == "shutdown"
    former.stop()
    successor.stop()
