from __future__ import annotations

import pytest

from pipros_workspace.cmake.scope import Scope
from tests.support.constants import Constants


def scope(**variables: str) -> Scope:
    return Scope(variables, {"CACHED": "c", "A": "from the cache"}, {"HOME": "/h"})


def test_variables_hide_cache_entries() -> None:
    current = scope(A="own")
    assert (current.values["A"], current.values["CACHED"]) == ("own", "c")
    current.unset("A")
    current.unset("NEVER")
    assert current.values["A"] == "from the cache"
    current.values["CACHED"] = "own"
    assert current.cache["CACHED"] == "c"


def test_variables_of_an_inner_scope_end_with_it_unless_set_in_the_parent() -> None:
    current = scope(A="1", B="2", C="3")
    with current.inner():
        current.values["A"] = "inner"
        current.values["NEW"] = "inner"
        current.set_in_parent("B", "set")
        current.set_in_parent("C", None)
        assert (current.values["B"], current.values["C"]) == ("2", "3")
        with current.inner():
            current.set_in_parent("A", "from two levels down")
        assert current.values["A"] == "from two levels down"
    assert dict(current.values) == {"A": "1", "B": "set", "CACHED": "c"}


def test_an_error_ends_an_inner_scope_as_well() -> None:
    current = scope(A="1")
    with pytest.raises(KeyError), current.inner():
        current.values["A"] = current.values["NOPE"]
    assert current.values["A"] == "1"


def test_restored_variables_have_their_former_values() -> None:
    current = scope(A="1")
    with current.restored(["A", "B"]):
        current.values.update({"A": "2", "B": "2", "C": "2"})
    assert (current.values["A"], current.values.get("B"), current.values["C"]) == ("1", None, "2")


@pytest.mark.parametrize(
    ("path", "source", "binary"),
    [("a", "/s/a", "/b/a"), ("../a", "/a", "/a"), ("/abs/./x", "/abs/x", "/abs/x"), ("", "/s", "/b")],
)
def test_paths_are_below_source_and_binary_folder(path: str, source: str, binary: str) -> None:
    current = scope(CMAKE_CURRENT_SOURCE_DIR="/s", CMAKE_CURRENT_BINARY_DIR="/b")
    assert (current.in_source(path), current.in_binary(path)) == (source, binary)


def test_the_size_of_variables_is_bounded_and_released(constants: Constants) -> None:
    constants(CMAKE_VALUE_CHARACTERS=10, CMAKE_CHARACTERS=20)
    current = Scope({}, {}, {})
    with pytest.raises(ValueError, match="more than 10 characters"):
        current.values["A"] = "x" * 11
    for _ in range(5):
        current.values["A"] = "x" * 10
        current.values["B"] = "y" * 10
        with pytest.raises(ValueError, match="more than 20 characters"):
            current.values["C"] = "z"
        current.unset("B")
        with current.inner():
            current.values["B"] = "y" * 10
        current.values["C"] = "z"
        current.unset("C")
