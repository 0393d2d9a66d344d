"""A started node imports what links need, if it can."""

from __future__ import annotations

import errno

import pytest

from pipros.node import node


def test_a_node_without_descriptors_imports_it_with_the_first_link(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> bool:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(node, "shares_memory", fail)
    node._load_links()
