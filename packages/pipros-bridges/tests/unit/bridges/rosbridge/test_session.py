"""The session of a client of rosbridge."""

from __future__ import annotations

from typing import get_args
from unittest.mock import MagicMock

from pipros.basics.limits import process_limits
from pipros_bridges.rosbridge.effects import Effect
from pipros_bridges.rosbridge.session import RosbridgeSession
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.shares import ServerShares


def test_each_effect_of_an_operation_is_carried_out() -> None:
    limits = process_limits()
    bridge = MagicMock(settings=RosbridgeSettings(), limits=limits)
    session = RosbridgeSession(bridge, MagicMock(), ServerShares(limits).client(is_reader=True))
    assert session._carry_out.keys() == set(get_args(Effect))
