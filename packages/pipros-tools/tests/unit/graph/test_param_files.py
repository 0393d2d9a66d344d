import sys
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from pipros.safe.yaml import YamlError
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.param_files import read_file, read_text
from pipros_tools.graph.param_text import as_document, as_pretty_text, as_shown, node_parameters
from pipros_tools.graph.params import leaves


def test_each_document_has_its_namespace() -> None:
    text = "a: 1\n---\n_ns: inner\nb: 2\n---\n_ns: /global\nc: 3\n"
    assert read_text(text, "file", "/robot") == [
        ({"a": 1}, "/robot"), ({"b": 2}, "/robot/inner"), ({"c": 3}, "/global")
    ]  # fmt: skip


def test_an_empty_file_has_no_parameters(tmp_path: Path) -> None:
    file = tmp_path / "empty.yaml"
    file.write_text("")
    assert read_file(str(file), "/") == []


def test_a_missing_file_is_named() -> None:
    with pytest.raises(GraphError, match=r"file \[/nowhere.yaml\] does not exist"):
        read_file("/nowhere.yaml", "/")


def test_a_private_namespace_is_refused() -> None:
    with pytest.raises(GraphError, match="private"):
        read_text("_ns: ~x\na: 1\n", "file", "/")


@pytest.mark.parametrize("text", ["a: !!python/object/apply:os.getpid []", "a: deg(exit)", "a: rad(2;3)"])
def test_a_parameter_file_runs_nothing(text: str) -> None:
    with pytest.raises(YamlError):
        read_text(text, "file", "/")


def test_invalid_angles_are_text() -> None:
    text = "deg(__import__('os').getpid())"
    assert read_text(f"a: {text}", "file", "/") == [({"a": text}, "/")]


def test_dictionaries_are_namespaces() -> None:
    assert list(leaves("/", {"a": {"b": 1, "c": [{"d": 2}]}, "e": {}})) == [("/a/b", 1), ("/a/c", [{"d": 2}])]


def test_keys_that_are_not_strings_are_refused() -> None:
    with pytest.raises(GraphError, match="must have string keys"):
        list(leaves("/", {"a": {1: 2}}))


@pytest.mark.parametrize(("value", "text"), [
    (3, "3\n"), (True, "true\n"), ("hello", "hello\n"), ("", "''\n\n"), ("3", "'3'\n\n"), ([], "[]\n\n"),
    ({"b": [1], "a": 2.5}, "a: 2.5\nb:\n- 1\n\n"),
])  # fmt: skip
def test_values_are_shown_as_noetic_shows_them(value: object, text: str) -> None:
    assert as_shown(value) == text


@given(
    st.text("abenoyxNUYE0159_./-: #'~\n", max_size=70)
    | st.sampled_from(["yes", "No", "TRUE", "off", "null", "NULL", "y", "N", ".inf", "1e3", "0x1", "=", "<<"])
)
def test_strings_are_written_like_pyyaml(text: str) -> None:
    assert as_document(text) == yaml.safe_dump(text)


SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text("abyN10_./-: #'~é\n", max_size=90)
    | st.sampled_from(
        ["/robot/scan", "http://host:11311/", "two words", "1.16.0\n", "a\n\nb's\n", "x: y", "é"]
    )
)
KEYS = st.text("abyN10_/: ", max_size=12) | st.sampled_from(["null", "host_a__1", "x" * 130])


@given(
    st.recursive(SCALARS, lambda part: st.lists(part, max_size=4) | st.dictionaries(KEYS, part, max_size=4),
        max_leaves=30),
)  # fmt: skip
def test_values_are_written_like_pyyaml(value: object) -> None:
    assert as_document(value) == yaml.safe_dump(value)


def test_a_repeated_list_is_written_like_pyyaml() -> None:
    twice = [1]
    assert as_document({"a": twice, "b": twice}) == "a: &id001\n- 1\nb: *id001\n"


@pytest.mark.parametrize("value", [
    1.5, "1.16.0\n", "noetic\n", {"rate": 10.0, "names": ["a", "b c"], "on_boot": None, "x": {}},
    [[1], [2]],
])  # fmt: skip
def test_common_values_are_written_without_pyyaml(value: object, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = yaml.safe_dump(value)
    monkeypatch.setitem(sys.modules, "yaml", None)
    assert as_document(value) == expected


def test_pretty_text_leaves_quotes_out() -> None:
    assert as_pretty_text({"b": {"c": "3"}, "a": "x\ny"}) == "a: |\n  x\n  y\nb:\n  c: 3\n"


def test_a_parameter_file_of_ros2_is_nested_and_names_what_it_leaves_out() -> None:
    tree = {"rate": 5, "gains": [1, 2.5], "pid": {"p": 0.5, "bad": None}, "mixed": [1, "a"], "empty": []}
    tree |= {"stamp": object()}

    document, left_out = node_parameters("/cam", tree)

    assert document == {"/cam": {"ros__parameters": {"rate": 5, "gains": [1.0, 2.5], "pid": {"p": 0.5}}}}
    assert sorted(left_out) == ["/cam/empty", "/cam/mixed", "/cam/pid/bad", "/cam/stamp"]
    assert node_parameters("/cam/rate", 5)[1] == {"/cam/rate": "it is a parameter, not the name of a node"}
