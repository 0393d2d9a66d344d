"""Tokens of the members that are present."""

from __future__ import annotations

from pipros.fleet import keys
from pipros.fleet.members import Members, Token

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
