"""Access rules for a router, which identifies each member by its certificate. Performs no I/O."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Final

from pipros_fleet import keys

ROUTER: Final = "router"
"""Common name of router certificates. Routers trust each other."""
_EVERYTHING: Final = f"{keys.ROOT}/**"
_ALL_MESSAGES: Final = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
)


class FleetRole(Enum):
    """A member's permissions. The values appear in the list of members."""

    MEMBER = "member"
    OBSERVER = "observer"
    """Receives topics and reads parameters. Cannot publish to members, call services or set parameters."""


def access_rules(members: Mapping[str, FleetRole]) -> dict[str, object]:
    """Return Zenoh's `access_control` section for a router. Everything that no rule allows is denied."""
    rules: list[dict[str, object]] = [
        _rule("receives", "egress", _ALL_MESSAGES, [_EVERYTHING]),
        _rule("routes", "ingress", _ALL_MESSAGES, [_EVERYTHING]),
    ]
    subjects: list[dict[str, object]] = [{"id": ROUTER, "cert_common_names": [ROUTER]}]
    policies: list[dict[str, object]] = [{"rules": ["receives", "routes"], "subjects": [ROUTER]}]
    for name, role in sorted(members.items()):
        member_rules = _rules_of(name, role)
        rules += member_rules
        subjects.append({"id": name, "cert_common_names": [name]})
        policies.append({"rules": ["receives", *(rule["id"] for rule in member_rules)], "subjects": [name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _rules_of(name: str, role: FleetRole) -> list[dict[str, object]]:
    every = "*"
    puts = [keys.directory(name), keys.wanted(name, every), keys.topic(name, keys.EVERY)]
    queries = [
        *(keys.asked(f"{keys.ROOT}/{every}/{keys.EVERY}", name), keys.wanted(every, name)),
        keys.parameters(every, "get", name),
    ]
    if role is FleetRole.MEMBER:
        puts.append(keys.into(name, every, keys.EVERY))
        queries += [keys.service(every, name, keys.EVERY), keys.parameters(every, "set", name)]
    subscriptions = [
        keys.directory(every),
        keys.wanted(every, name),
        keys.topic(every, keys.EVERY),
        keys.into(every, name, keys.EVERY),
    ]
    return [
        _rule(f"{name} puts", "ingress", ["put"], puts),
        _rule(f"{name} asks", "ingress", ["query"], queries),
        _rule(f"{name} subscribes", "ingress", ["declare_subscriber"], subscriptions),
        _rule(
            f"{name} answers", "ingress", ["declare_queryable", "reply"], [f"{keys.ROOT}/{name}/{keys.EVERY}"]
        ),
        _rule(f"{name} is present", "ingress", ["liveliness_token"], [keys.live(name)]),
        _rule(
            f"{name} sees",
            "ingress",
            ["liveliness_query", "declare_liveliness_subscriber"],
            [keys.live(every)],
        ),
    ]


def _rule(name: str, flow: str, messages: Sequence[str], patterns: Sequence[str]) -> dict[str, object]:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": list(patterns),
    }
