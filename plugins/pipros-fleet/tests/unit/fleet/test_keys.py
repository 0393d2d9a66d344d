"""Keys of the fleet protocol."""

from __future__ import annotations

import pytest

from pipros.basics.errors import InvalidName
from pipros_fleet import keys


@pytest.mark.parametrize(
    "name", ["/chatter", "/a/b_1/C", "/_x/9", "/with space", "/ü/*/$#?", "/@a", "/a%2Fb"]
)
def test_names_survive_a_key(name: str) -> None:
    key = keys.topic("r1", name)
    found = keys.parts(key)
    assert found is not None
    member, kind, rest = found
    assert (member, kind) == ("r1", "t")
    assert keys.unmangled("/".join(rest)) == name
    assert not set("*$#?@") & set(key)


@pytest.mark.parametrize(("members", "pattern"), [
    ("*", "*"), ("**", "*"), ("robot*", "robot$*"), ("*_a", "$*_a"), ("a/b*", "a_b$*"), ("", "_"),
    ("r1", "r1"),
])  # fmt: skip
def test_members_with_wildcards_become_patterns(members: str, pattern: str) -> None:
    assert keys.pattern_of(members) == pattern


def test_tokens_are_read_strictly() -> None:
    token = keys.live("r1", 1, "0123456789abcdef")
    assert keys.read_live(token) == ("r1", 1, "0123456789abcdef")
    for wrong in ("pipros/r1/live/1/x", "pipros/r1/live/x/0123456789abcdef", "pipros/r 1/live/1/" + "0" * 16):
        assert keys.read_live(wrong) is None
    assert keys.read_live("other/r1/live/1/0123456789abcdef") is None
    assert keys.read_live("pipros/r1/t/x") is None
    assert keys.parts("pipros") is None


@pytest.mark.parametrize(("key", "expected"), [
    (keys.directory("r1"), ("r1", "directory", [])), (keys.wanted("r1", "op"), ("r1", "wanted", ["op"])),
    (keys.into("op", "r1", "/cmd vel"), ("op", "in", ["r1", "cmd%20vel"])),
    (keys.service("r1", "op", "/arm/move"), ("r1", "s", ["op", "arm", "move"])),
    (keys.parameters("r1", "get", "op"), ("r1", "get", ["op"])),
    (keys.definition("r1", "std_msgs/String"), ("r1", "definition", ["std_msgs%2FString"])),
    (keys.statistics("r1"), ("r1", "statistics", [])),
])  # fmt: skip
def test_keys_begin_with_the_member_that_publishes_or_answers(
    key: str, expected: tuple[str, str, list[str]]
) -> None:
    assert keys.parts(key) == expected


@pytest.mark.parametrize("name", ["", "a/b", "1a", "a-b", "*", "a b", "/a"])
def test_illegal_members_raise(name: str) -> None:
    with pytest.raises(InvalidName, match="is not a legal name for a member"):
        keys.member_name(name)
    assert keys.member_name("robot_1") == "robot_1"
