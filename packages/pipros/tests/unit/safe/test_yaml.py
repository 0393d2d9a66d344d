import io
import math
from collections.abc import Callable
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from pipros.safe.settings import BadSettings, Settings
from pipros.safe.yaml import TooMuch, YamlError, check_outline, load, load_all
from tests.support.constants import Constants, changed


@pytest.mark.parametrize(("text", "value"), [
    ("a: [1, 2.5, true, text]", {"a": [1, 2.5, True, "text"]}), ("0777", 0o777), ("1e3", "1e3"),
    ("yes", True), ("~", None), ("", None), ("a: deg(90)", {"a": math.pi / 2}),
    ("a: rad(pi/2)", {"a": math.pi / 2}), ("a: rad( pi )", {"a": math.pi}),
    ("a: !degrees 180", {"a": math.pi}), ("a: !radians pi", {"a": math.pi}),
    ("[rad(1), 'rad(pi)', rad(1) + 2]", [1.0, "rad(pi)", "rad(1) + 2"]),
    ("base: &b {x: 1}\nother: {<<: *b, y: 2}", {"base": {"x": 1}, "other": {"x": 1, "y": 2}}),
])  # fmt: skip
def test_parameter_files_are_read_as_genuine_ros_reads_them(text: str, value: Any) -> None:
    assert load(text) == value


def test_angles_can_be_left_as_text() -> None:
    assert load("a: rad(pi)", angles=False) == {"a": "rad(pi)"}


def test_several_documents_are_all_given() -> None:
    assert (load_all("a: 1\n---\nb: 2"), load_all("")) == ([{"a": 1}, {"b": 2}], [])
    with pytest.raises(YamlError, match="single document"):
        load("a: 1\n---\nb: 2")


@pytest.mark.parametrize(("text", "place"), [
    ("a: 1\nb: [", "p.yaml:3:1"), ("a: 'x", "p.yaml:1:"),
    ("!!python/object/apply:os.system ['true']", "p.yaml:1:1"), ("!!python/name:os.system", "p.yaml:1:1"),
    ("a: rad(__import__)", "p.yaml:1:4"), ("a: !radians x.y", "p.yaml:1:4"), ("a: deg(x)", "p.yaml:1:4"),
    ("a: rad(9**9**9)", "p.yaml:1:4"), ("? [1]\n: 2", "p.yaml:1:"),
    ("a: !!bool maybe", "p.yaml: invalid YAML: a value does not fit its tag"),
    ("!!int ''", "p.yaml: invalid YAML: a value does not fit its tag"),
    ("!!timestamp soon", "p.yaml: invalid YAML: a value does not fit its tag"),
    ("1:" * 1000 + "1.5", "p.yaml: invalid YAML: a value does not fit its tag"), ("9" * 5000, "p.yaml:1:1"),
])  # fmt: skip
def test_a_bad_document_is_refused_with_its_place(text: str, place: str) -> None:
    with pytest.raises(YamlError) as error:
        load(text, "p.yaml")
    assert str(error.value).startswith(place)
    assert isinstance(error.value, yaml.YAMLError)  # as programs for Noetic expect
    assert "NoneType" not in str(error.value)


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


# The number of values in a YAML text, with aliases expanded, before any is built.


LOADERS = [yaml.SafeLoader, *([yaml.CSafeLoader] if hasattr(yaml, "CSafeLoader") else [])]


def fits(text: str | bytes, values: int, depth: int = 100, loader: Any = yaml.SafeLoader) -> bool:
    try:
        with changed(YAML_VALUES=values, YAML_DEPTH=depth):
            check_outline(loader, text)
    except TooMuch:
        return False
    return True


def count_of(value: Any) -> int:
    """Return the values in a built value: itself, and those in it."""
    if isinstance(value, dict):
        return 1 + sum(count_of(part) for pair in value.items() for part in pair)
    if isinstance(value, list):
        return 1 + sum(map(count_of, value))
    return 1


plain = st.recursive(
    st.one_of(st.integers(), st.booleans(), st.text(alphabet="abc", max_size=3)),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(alphabet="xy", max_size=2), inner),
    max_leaves=12,
)


@pytest.mark.parametrize("loader", LOADERS)
@given(value=plain)
def test_each_value_counts_once(loader: Any, value: Any) -> None:
    text = yaml.safe_dump(value)

    assert fits(text, count_of(value), loader=loader)
    assert count_of(value) == 1 or not fits(text, count_of(value) - 1, loader=loader)


@pytest.mark.parametrize("loader", LOADERS)
def test_an_alias_counts_as_what_it_refers_to(loader: Any) -> None:
    doubling = "a0: &a0 [1, 2]\n" + "".join(f"a{n + 1}: &a{n + 1} [*a{n}, *a{n}]\n" for n in range(40))

    assert not fits(doubling, 1_000_000, loader=loader)


def test_an_anchor_belongs_to_its_document() -> None:
    assert fits("&a [1, 2, 3]\n---\n&a 1\n---\n[*a]\n", 8)


@pytest.mark.parametrize("encode", [str, str.encode, lambda text: text.encode("utf-16")])
def test_texts_and_bytes_count_alike(encode: Any) -> None:
    assert fits(encode("[1, 2]"), 3)
    assert not fits(encode("[1, 2]"), 2)


def test_directives_are_limited() -> None:
    with pytest.raises(TooMuch, match="%TAG"):
        check_outline(yaml.SafeLoader, "%TAG !a! b\n" * 101 + "--- 1\n")


# Files of settings: values, defaults, and errors that name the file, the line and the key.


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
    assert (top.text("name"), top.text("other", "none")) == ("arm", "none")
    assert top.choice("name", ("leg", "arm"), "leg") == "arm"
    assert (top.choice("missing", ("leg", "arm"), "leg"), top.number("rate", None, least=1)) == ("leg", 30)
    assert (top.number("missing", 0.5, least=0), top.numbers("limits")) == (0.5, (1, 2.5))
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
