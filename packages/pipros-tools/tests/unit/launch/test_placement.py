from __future__ import annotations

import getpass

import pytest

from pipros_tools.launch import placement
from pipros_tools.launch.model import LaunchNode, Machine
from pipros_tools.launch.placement import Placement, is_local

BASE = Machine("base", "base.local")


@pytest.fixture
def lookups(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The resolved addresses; only `localhost` is this computer."""
    found: list[str] = []

    def is_this_machine(host: str) -> bool:
        found.append(host)
        return host == "localhost"

    monkeypatch.setattr(placement, "is_this_machine", is_this_machine)
    return found


def test_a_machine_is_looked_up_once_and_only_when_a_node_needs_it(lookups: list[str]) -> None:
    machines = {
        "base": BASE,
        "near": Machine("near", "localhost"),
        "unused": Machine("unused", "unused.local"),
    }
    nodes = Placement(machines)
    for _ in range(3):
        assert nodes.remote_machine(LaunchNode("p", "t", "n", machine="base")) is BASE
        assert nodes.remote_machine(LaunchNode("p", "t", "n", machine="near")) is None
        assert nodes.remote_machine(LaunchNode("p", "t", "n")) is None
    assert lookups == ["base.local", "localhost"]


def test_this_computer_is_local_for_its_own_user_only(lookups: list[str]) -> None:
    assert is_local(Machine("m", "localhost", user=getpass.getuser()))
    assert not is_local(Machine("m", "localhost", user=getpass.getuser() + "x"))
    assert lookups == ["localhost"]
