"""Command lines: remappings, parameters, and the remaining arguments."""

from typing import Any

import pytest

from pipros.basics import names
from pipros.basics.words import quoted, split_words


def test_a_command_line_is_sorted_by_what_its_arguments_are_for() -> None:
    parsed = names.parse_arguments(
        ["prog", "a:=b", "_rate:=3", "__name:=t", "file", ":=x", "_:=c", " chat := /talk "]
    )
    assert parsed.remappings == {"a": "b", "_": "c", "chat": "/talk"}
    assert (parsed.params, parsed.special) == ({"rate": "3"}, {"__name": "t"})
    assert (parsed.rest, parsed.malformed) == (("prog", "file", ":=x"), ())


def test_an_argument_with_two_assignments_is_malformed() -> None:
    parsed = names.parse_arguments(["a:=b:=c", "d:=e"])
    assert (parsed.malformed, parsed.remappings) == (("a:=b:=c",), {"d": "e"})


def test_an_empty_assignment_is_ignored() -> None:
    parsed = names.parse_arguments(["chat:=", "chat:= "])
    assert (parsed.remappings, parsed.rest, parsed.malformed) == ({}, (), ())


def test_remappings_are_resolved_on_both_sides_for_the_node() -> None:
    written = {"chat": "talk", "~rate": "/rate", "/global": "~mine"}
    assert names.resolve_remappings(written, "/robot/node") == {
        "/robot/chat": "/robot/talk", "/robot/node/rate": "/rate", "/global": "/robot/node/mine",
    }  # fmt: skip


def test_only_arguments_with_legal_names_are_remappings() -> None:
    legal = ["a:=b", "_rate:=5", "__name:=x", "/robot/chat:=talk", "a:="]
    others = ["-a:=b", "a b:=c", ":=b", "a=b"]
    assert [item for item in [*legal, *others] if names.is_legal_remapping(item)] == legal


@pytest.mark.parametrize("name", [None, b"rate", 5])
def test_only_text_is_a_name(name: Any) -> None:
    with pytest.raises(names.InvalidName, match=r"a name must be a string, got "):
        names.resolve(name, "/talker")


def test_topics_in_a_parameter_are_used_without_the_bad_ones() -> None:
    said: list[str] = []
    assert names.valid_topics("~topics", ["/a", 5, "b c", "/", "b/", None], said.append) == ["/a", "b/"]
    assert said == [
        f"~topics: {bad} is not a topic name; it is left out" for bad in ("5", "'b c'", "'/'", "None")
    ]
    assert names.valid_topics("~topics", "/a", said.append) == []
    assert said[-1] == "~topics must be a list of topics, got '/a'; it is ignored"


def test_arguments_that_roslaunch_appends_are_removed_and_no_others() -> None:
    appended = ["a:=b", "__name:=n", "__log:=/l.log"]
    assert names.without_launch_arguments(["kill", "-a", *appended]) == ["kill", "-a"]
    assert names.without_launch_arguments(appended) == []
    assert names.without_launch_arguments(["set", "pair", "a:=b"]) == ["set", "pair", "a:=b"]


# Command lines as words.


@pytest.mark.parametrize(("text", "posix", "windows"), [
    (r"a\ b c", ["a b", "c"], ["a\\", "b", "c"]),
    (r"C:\maps\x.yaml '--title=a b'", ["C:mapsx.yaml", "--title=a b"], [r"C:\maps\x.yaml", "--title=a b"]),
    (r'"C:\my maps\new.yaml" # 2', [r"C:\my maps\new.yaml", "#", "2"], [r"C:\my maps\new.yaml", "#", "2"]),
    ("--x=a'b'\"c\" ''", ["--x=abc", ""], ["--x=abc", ""]),
])  # fmt: skip
def test_backslashes_stay_in_paths_of_windows(
    text: str, posix: list[str], windows: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros.basics.words.ON_WINDOWS", False)
    assert split_words(text) == posix
    monkeypatch.setattr("pipros.basics.words.ON_WINDOWS", True)
    assert split_words(text) == windows
    with pytest.raises(ValueError, match="No closing quotation"):
        split_words("'open")


def test_words_are_quoted_for_the_shells_of_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros.basics.words.ON_WINDOWS", True)
    assert quoted("C:\\Python311\\python.exe") == "C:\\Python311\\python.exe"
    assert quoted("pipros[course]") == '"pipros[course]"'
