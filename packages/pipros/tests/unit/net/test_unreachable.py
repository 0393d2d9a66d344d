"""The advice about an unreachable peer depends on the likely reason."""

from __future__ import annotations

import asyncio

import pytest

from pipros.basics.uri import host_of
from pipros.net.unreachable import explain


@pytest.mark.parametrize(
    ("peer", "advice"),
    [
        ("http://no-such-robot.invalid:1234/", "cannot resolve the name [no-such-robot.invalid]: set ROS_IP"),
        ("http://localhost:1/", "is local: the node has ended"),
        ("203.0.113.5:1", "a firewall blocks it"),
    ],
)
def test_advice_fits_the_address(peer: str, advice: str) -> None:
    assert advice in asyncio.run(explain(peer))


def test_a_host_is_recognised_in_every_form() -> None:
    peers = ("http://robot:123/", "10.0.0.1:5", "http://[::1]:80/", "rosrpc://a:1")
    assert [host_of(peer) for peer in peers] == ["robot", "10.0.0.1", "::1", "a"]
