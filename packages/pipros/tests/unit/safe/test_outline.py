"""The number of values in a YAML text, with aliases expanded, before any is built."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from pipros.safe.yaml import TooMuch, check_outline
from tests.support.constants import changed

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
