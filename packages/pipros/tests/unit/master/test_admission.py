from __future__ import annotations

import pytest

from pipros.master.master import AllowedNetworks
from pipros.net.this_machine import ThisMachineCaller

ALLOWED = AllowedNetworks(["10.0.0.0/8", "192.168.1.7"])


@pytest.mark.parametrize("peer", ["10.1.2.3", "192.168.1.7", "127.0.0.1", "::1"])
def test_allowed_networks_and_this_computer_may_connect(peer: str) -> None:
    assert ALLOWED.admits(ThisMachineCaller(peer))


@pytest.mark.parametrize("peer", ["11.0.0.1", "192.168.1.8", "fe80::1%eth0", "nonsense"])
def test_other_callers_may_not(peer: str) -> None:
    assert not ALLOWED.admits(ThisMachineCaller(peer))


def test_an_invalid_network_is_an_error() -> None:
    with pytest.raises(ValueError, match="nonsense"):
        AllowedNetworks(["nonsense"])
