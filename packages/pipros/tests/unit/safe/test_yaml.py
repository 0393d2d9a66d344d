from __future__ import annotations

import io
import math
from typing import Any

import pytest

from pipros.safe.yaml import YamlError, load, load_all
from tests.support.constants import Constants


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: [1, 2.5, true, text]", {"a": [1, 2.5, True, "text"]}),
        ("0777", 0o777),
        ("1e3", "1e3"),
        ("yes", True),
        ("~", None),
        ("", None),
        ("a: deg(90)", {"a": math.pi / 2}),
        ("a: rad(pi/2)", {"a": math.pi / 2}),
        ("a: rad( pi )", {"a": math.pi}),
        ("a: !degrees 180", {"a": math.pi}),
        ("a: !radians pi", {"a": math.pi}),
        ("[rad(1), 'rad(pi)', rad(1) + 2]", [1.0, "rad(pi)", "rad(1) + 2"]),
        ("base: &b {x: 1}\nother: {<<: *b, y: 2}", {"base": {"x": 1}, "other": {"x": 1, "y": 2}}),
    ],
)
def test_parameter_files_are_read_as_genuine_ros_reads_them(text: str, value: Any) -> None:
    assert load(text) == value


def test_angles_can_be_left_as_text() -> None:
    assert load("a: rad(pi)", angles=False) == {"a": "rad(pi)"}


def test_several_documents_are_all_given() -> None:
    assert load_all("a: 1\n---\nb: 2") == [{"a": 1}, {"b": 2}]
    assert load_all("") == []
    with pytest.raises(YamlError, match="single document"):
        load("a: 1\n---\nb: 2")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("a: 1\nb: [", "p.yaml:3:1"),
        ("a: 'x", "p.yaml:1:"),
        ("!!python/object/apply:os.system ['true']", "p.yaml:1:1"),
        ("!!python/name:os.system", "p.yaml:1:1"),
        ("a: rad(__import__)", "p.yaml:1:4"),
        ("a: !radians x.y", "p.yaml:1:4"),
        ("a: deg(x)", "p.yaml:1:4"),
        ("a: rad(9**9**9)", "p.yaml:1:4"),
        ("? [1]\n: 2", "p.yaml:1:"),
        ("a: !!bool maybe", "p.yaml: invalid YAML: a value does not fit its tag"),
        ("!!int ''", "p.yaml: invalid YAML: a value does not fit its tag"),
        ("!!timestamp soon", "p.yaml: invalid YAML: a value does not fit its tag"),
        ("1:" * 1000 + "1.5", "p.yaml: invalid YAML: a value does not fit its tag"),
        ("9" * 5000, "p.yaml:1:1"),
    ],
)
def test_a_bad_document_is_refused_with_its_place(text: str, place: str) -> None:
    with pytest.raises(YamlError) as error:
        load(text, "p.yaml")
    assert str(error.value).startswith(place)


def test_multiplying_aliases_are_refused() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    with pytest.raises(YamlError, match="expands to more than"):
        load("\n".join(lines))


def test_an_alias_to_itself_is_refused() -> None:
    with pytest.raises(YamlError, match=r":1:5: \*a is inside the value that it refers to"):
        load("&a [*a]")


def test_deep_nesting_is_refused() -> None:
    with pytest.raises(YamlError, match="nested"):
        load("[" * 200 + "]" * 200)


def test_aliases_are_counted_at_each_use(constants: Constants) -> None:
    text = "a: &a [1, 2]\nb: [*a, *a]\n"

    constants(YAML_VALUES=13)
    assert load(text) == {"a": [1, 2], "b": [[1, 2], [1, 2]]}
    constants(YAML_VALUES=12)
    with pytest.raises(YamlError, match=r"^<string>:2:9: the text expands to more than 12 values"):
        load(text)


def test_an_alias_is_as_deep_as_its_value(constants: Constants) -> None:
    text = "a: &a [[1]]\nb: [[*a]]\n"

    constants(YAML_DEPTH=5)
    assert load(text) == {"a": [[1]], "b": [[[[1]]]]}
    constants(YAML_DEPTH=4)
    with pytest.raises(YamlError, match=r"^<string>:2:6: the text is nested more than 4 deep"):
        load(text)


def test_an_anchor_may_be_used_again_in_the_next_document() -> None:
    assert load_all("- &a 1\n- *a\n---\n- &a [2]\n- *a\n") == [[1, 1], [[2], [2]]]


def test_merged_mappings_are_unchanged() -> None:
    text = "a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\nc: {<<: [{x: 5}, *a]}"

    assert load(text) == {"a": {"x": 1, "y": 2}, "b": {"x": 1, "y": 3}, "c": {"x": 5, "y": 2}}


def test_files_and_bytes_are_read() -> None:
    assert load(io.StringIO("a: 1")) == load(io.BytesIO(b"a: 1")) == load("a: 1".encode("utf-16")) == {"a": 1}
