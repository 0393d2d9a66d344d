"""Tokens of the members that are present."""

from __future__ import annotations

from pipros_fleet import keys
from pipros_fleet.members import TOKENS_PER_MEMBER, Members, Token

OLD, NEW = "0" * 16, "1" * 16


def test_the_newer_of_two_runs_is_used() -> None:
    members = Members(10)
    assert members.update(keys.live("r1", 1, NEW), is_present=True) == Token("r1", NEW)
    assert members.update(keys.live("r1", 1, OLD), is_present=True) == Token("r1", OLD)
    assert members.update(keys.live("r1", 1, OLD), is_present=True) is None
    assert members.present() == {"r1": Token("r1", NEW)}
    assert [token.instance for token in members.of("r1")] == [OLD, NEW]
    assert members.update(keys.live("r1", 1, NEW), is_present=False) == Token("r1", NEW)
    assert members.present() == {"r1": Token("r1", OLD)}


def test_members_of_other_versions_are_not_used() -> None:
    members = Members(10)
    members.update(keys.live("r1", 2, OLD), is_present=True)
    assert members.present() == {}
    assert members.of("r1") == [Token("r1", OLD, 2)]


def test_malformed_tokens_and_too_many_are_ignored() -> None:
    members = Members(1)
    assert members.update("pipros/r1/live/x/y", is_present=True) is None
    members.update(keys.live("r1", 1, OLD), is_present=True)
    assert members.update(keys.live("r2", 1, OLD), is_present=True) is None
    assert members.update(keys.live("r2", 1, OLD), is_present=False) is None
    assert set(members.present()) == {"r1"}


def test_a_member_waits_for_room_and_is_admitted_once() -> None:
    members = Members(1)
    members.update(keys.live("r1", 1, OLD), is_present=True)
    for instance in (OLD, NEW):
        assert members.update(keys.live("r2", 1, instance), is_present=True) is None
    assert members.admit_waiting() == []

    members.update(keys.live("r1", 1, OLD), is_present=False)
    # At most as many tokens wait as the limit allows names.
    assert members.admit_waiting() == [Token("r2", OLD)]
    assert members.admit_waiting() == []
    assert members.present() == {"r2": Token("r2", OLD)}


def test_two_waiting_tokens_of_one_name_share_its_place() -> None:
    members = Members(2)
    for name in ("r1", "r2"):
        members.update(keys.live(name, 1, OLD), is_present=True)
    for instance in (OLD, NEW):
        members.update(keys.live("r3", 1, instance), is_present=True)
    members.update(keys.live("r1", 1, OLD), is_present=False)

    assert members.admit_waiting() == [Token("r3", OLD), Token("r3", NEW)]
    assert members.present() == {"r2": Token("r2", OLD), "r3": Token("r3", NEW)}


def test_a_member_that_leaves_while_it_waits_is_not_admitted() -> None:
    members = Members(1)
    members.update(keys.live("r1", 1, OLD), is_present=True)
    members.update(keys.live("r2", 1, OLD), is_present=True)
    members.update(keys.live("r2", 1, OLD), is_present=False)
    members.update(keys.live("r1", 1, OLD), is_present=False)

    assert members.admit_waiting() == []


def test_the_newest_tokens_of_a_name_are_kept_and_the_name_is_reported() -> None:
    members = Members(10)
    instances = [f"{number:016x}" for number in range(1, TOKENS_PER_MEMBER + 2)]
    for instance in instances:
        assert members.update(keys.live("r1", 1, instance), is_present=True) == Token("r1", instance)
    assert members.update(keys.live("r1", 1, "0" * 16), is_present=True) is None

    assert [token.instance for token in members.of("r1")] == instances[1:]
    assert members.crowded == {"r1"}
