"""Which tests only `script/long` runs."""

from __future__ import annotations

import pytest

from tests.support import long_tests
from tests.support.environments import REPOSITORY


def test_each_line_names_a_test_that_exists() -> None:
    for line in long_tests.patterns():
        file, _, name = line.lstrip("0123456789 ").partition("::")
        (found,) = (each for top in ("packages", "plugins") if (each := REPOSITORY / top / file).is_file())
        text = found.read_text(encoding="utf-8")
        function = name.partition("[")[0]
        assert function == "*" or f"def {function}(" in text, line


def test_a_star_stands_for_any_characters_and_a_number_for_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    listed = ("a/test_x.py::test_one[b*]", "a/test_x.py::test_two", "3 a/test_x.py::test_three")
    monkeypatch.setattr(long_tests, "patterns", lambda: listed)
    caches = (long_tests._pattern, long_tests._strides)
    for each in caches:
        each.cache_clear()
    try:
        names = ["test_one", "test_one[b 1]", "test_one[c]", "test_two", "test_two[1]"]
        names += [f"test_three[{case}]" for case in "abcdefg"]
        found = long_tests.find_long(f"packages/a/test_x.py::{name}" for name in names)
        assert {each.partition("::")[2] for each in found} == {
            "test_one[b 1]",
            "test_two",
            *(f"test_three[{case}]" for case in "bcef"),
        }
    finally:
        for each in caches:
            each.cache_clear()
