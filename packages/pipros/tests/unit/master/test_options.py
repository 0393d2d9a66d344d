"""Options of the master: limits, and networks that may connect."""

from dataclasses import fields

import pytest

from pipros.basics.limits import process_limits
from pipros.master.master import AllowedNetworks
from pipros.master.options import MasterOptions, MasterSettings, limits_with_timeout
from pipros.net.this_machine import ThisMachineCaller


def test_each_option_is_a_keyword_argument_of_master_and_core() -> None:
    hints = MasterSettings.__annotations__
    assert [(field.name, field.type) for field in fields(MasterOptions)] == [
        (name, hint.__forward_arg__) for name, hint in hints.items()
    ]


@pytest.mark.parametrize("timeout_s", [None, 0.0, -1.0, float("nan")])
def test_a_timeout_that_is_not_positive_leaves_the_default(timeout_s: float | None) -> None:
    assert limits_with_timeout(timeout_s) == process_limits()


def test_the_timeout_option_is_the_timeout_of_notifications() -> None:
    assert limits_with_timeout(2.5).notice_s == 2.5


# Admission


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
