"""Files of settings: values, defaults, and errors that name the file, the line and the key."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from pipros.safe.settings import BadSettings, Settings
from pipros.safe.yaml import YamlError

TEXT = """\
name: arm
rate: 30
limits: [1, 2.5]
one: 7
parts:
  left: {kind: a, tags: [x, y]}
  right:
    kind: b
nothing:
"""


def settings(text: str = TEXT) -> Settings:
    return Settings.parsed(text, "robot.yaml")


def test_values_are_read_with_defaults() -> None:
    top = settings()
    assert top.text("name") == "arm"
    assert top.text("other", "none") == "none"
    assert top.choice("name", ("leg", "arm"), "leg") == "arm"
    assert top.choice("missing", ("leg", "arm"), "leg") == "leg"
    assert top.number("rate", None, least=1) == 30
    assert top.number("missing", 0.5, least=0) == 0.5
    assert top.numbers("limits") == (1, 2.5)
    assert top.numbers("one") == (7,)
    assert top.numbers("missing") == top.texts("missing") == ()
    assert [(part.key, part.text("kind")) for part in top.section("parts").sections()] == [
        ("parts.left", "a"),
        ("parts.right", "b"),
    ]
    assert top.section("parts").section("left").texts("tags") == ("x", "y")
    assert top.texts("name") == ("arm",)
    assert top.section("nothing").values == top.section("missing").values == {}
    top.only(["name", "rate", "limits", "one", "parts", "nothing"])


@pytest.mark.parametrize(
    ("use", "reason"),
    [
        (lambda top: top.text("missing"), "robot.yaml: missing: is missing"),
        (lambda top: top.text("rate"), "robot.yaml:2: rate: must be a non-empty string, got 30"),
        (lambda top: top.choice("name", ("leg",), "leg"), "1: name: must be one of leg, got 'arm'"),
        (lambda top: top.number("missing", None, least=0), "robot.yaml: missing: is missing"),
        (
            lambda top: top.number("name", 1, least=0),
            "robot.yaml:1: name: must be a finite number >= 0, got 'arm'",
        ),
        (lambda top: top.number("rate", 1, least=0, most=9), "rate: must be a number from 0 to 9, got 30"),
        (lambda top: top.numbers("name"), "name: must be a number or a list of numbers, got 'arm'"),
        (lambda top: top.texts("limits"), "limits: must be a string or a list of strings, got [1, 2.5]"),
        (lambda top: top.section("name"), "robot.yaml:1: name: must be a mapping, got 'arm'"),
        (lambda top: top.section("parts").section("right").text("x"), "7: parts.right.x: is missing"),
        (lambda top: top.only(["nam"]), "robot.yaml:1: name: unknown key. Did you mean nam?"),
        (lambda top: top.only(["x", "b"]), "robot.yaml:1: name: unknown key. The keys are b, x"),
        (lambda top: list(settings("a-b: {}").sections()), "robot.yaml:1: a-b: must consist of letters"),
        (lambda top: settings("[1]"), "robot.yaml: must be a mapping, got list"),
    ],
)  # fmt: skip
def test_errors_name_the_place(use: Callable[[Settings], Any], reason: str) -> None:
    with pytest.raises(BadSettings) as raised:
        use(settings())
    assert reason in str(raised.value)


def test_a_place_without_a_key_is_the_file() -> None:
    assert settings().place() == "robot.yaml"
    assert str(settings().error("", "is empty")) == "robot.yaml: is empty"


def test_text_that_is_not_yaml_raises_the_error_of_the_reader() -> None:
    with pytest.raises(YamlError, match=r"robot\.yaml:3:1: invalid YAML"):
        settings("a: 1\nb: [\n")


def test_a_key_that_occurs_twice_is_an_error() -> None:
    with pytest.raises(BadSettings, match=r"robot\.yaml:3: the key rate occurs twice"):
        Settings.parsed("a:\n  rate: 1\n  rate: 2\n", "robot.yaml")
