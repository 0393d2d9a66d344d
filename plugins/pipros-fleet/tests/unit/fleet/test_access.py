"""Access rules of a router."""

from typing import Any

import pytest
import zenoh

from pipros_fleet import keys
from pipros_fleet.access import ROUTER, FleetRole, access_rules

_QUESTIONS = [
    *(keys.directory("other"), keys.topic("other", "/x"), keys.definition("other", "a/B")),
    *(keys.statistics("other"), keys.history("other"), keys.history("other", "a.mcap")),
]
MEMBERS = {"robot": FleetRole.MEMBER, "visitor": FleetRole.OBSERVER}


def may(name: str, message: str, key: str) -> bool:
    """Return whether a router accepts a message with a key from the owner of a certificate."""
    found: Any = access_rules(MEMBERS)
    allowed = {
        rule for policy in found["policies"] if policy["subjects"] == [name] for rule in policy["rules"]
    }
    return any(
        rule["id"] in allowed
        and "ingress" in rule["flows"]
        and message in rule["messages"]
        and any(zenoh.KeyExpr(pattern).includes(zenoh.KeyExpr(key)) for pattern in rule["key_exprs"])
        for rule in found["rules"]
    )


@pytest.mark.parametrize(("message", "own", "of_another"), [
    ("put", keys.topic("robot", "/x"), keys.topic("other", "/x")),
    ("put", keys.directory("robot"), keys.directory("other")),
    ("put", keys.into("robot", "other", "/cmd"), keys.into("other", "robot", "/cmd")),
    *(("query", *(keys.asked(key, asker) for asker in ("robot", "other"))) for key in _QUESTIONS),
    ("query", keys.service("other", "robot", "/reset"), keys.service("other", "visitor", "/reset")),
    ("query", keys.parameters("other", "set", "robot"), keys.parameters("other", "set", "visitor")),
    ("declare_queryable", keys.statistics("robot"), keys.statistics("other")),
    ("liveliness_token", keys.live("robot", 1, "0" * 16), keys.live("other", 1, "0" * 16)),
    ("declare_subscriber", keys.into("other", "robot", "/x"), keys.into("robot", "other", "/x")),
])  # fmt: skip
def test_a_member_may_only_use_its_own_keys(message: str, own: str, of_another: str) -> None:
    assert may("robot", message, own)
    assert not may("robot", message, of_another)


def test_an_observer_receives_but_changes_nothing() -> None:
    assert may("visitor", "declare_subscriber", keys.topic("robot", "/x"))
    assert may("visitor", "query", keys.parameters("robot", "get", "visitor"))
    assert may("visitor", "query", keys.asked(keys.history("robot", "a.mcap"), "visitor"))
    assert not may("visitor", "put", keys.into("visitor", "robot", "/cmd"))
    assert not may("visitor", "query", keys.service("robot", "visitor", "/reset"))
    assert not may("visitor", "query", keys.parameters("robot", "set", "visitor"))


def test_routers_may_forward_everything_and_strangers_nothing() -> None:
    assert may(ROUTER, "put", keys.topic("robot", "/x"))
    assert not may("stranger", "put", keys.topic("stranger", "/x"))
    assert access_rules(MEMBERS)["default_permission"] == "deny"
