"""Which tests only `script/long` runs."""

from __future__ import annotations

import pytest

from tests.support import long_tests
from tests.support.environments import REPOSITORY


def test_each_line_names_a_test_that_exists() -> None:
    for line in long_tests.patterns():
        file, _, name = line.partition("::")
        text = (REPOSITORY / "packages" / file).read_text(encoding="utf-8")
        function = name.partition("[")[0]
        assert function == "*" or f"def {function}(" in text, line


def test_a_star_stands_for_any_characters_and_brackets_for_themselves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    listed = ("a/test_x.py::test_one[b*]", "a/test_x.py::test_two")
    monkeypatch.setattr(long_tests, "patterns", lambda: listed)
    long_tests._pattern.cache_clear()
    try:
        names = ["test_one", "test_one[b 1]", "test_one[c]", "test_two", "test_two[1]"]
        found = [name for name in names if long_tests.is_long(f"packages/a/test_x.py::{name}")]
        assert found == ["test_one[b 1]", "test_two"]
    finally:
        long_tests._pattern.cache_clear()
