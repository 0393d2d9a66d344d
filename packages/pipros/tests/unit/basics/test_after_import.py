"""Functions that are called after the import of a module."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

from pipros.basics.after_import import after_import


@pytest.fixture
def name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "late_module.py").write_text("VALUE = 1")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.delitem(sys.modules, "late_module", raising=False)
    return "late_module"


def test_a_function_is_called_once_after_the_first_import(name: str) -> None:
    seen: list[int] = []

    def see(module: ModuleType) -> None:
        seen.append(module.VALUE)

    after_import(name, see)
    after_import(name, see)
    import_module("colorsys")
    assert seen == []
    import_module(name)
    import_module(name)
    assert seen == [1]
    after_import(name, see)
    assert seen == [1, 1]


def test_a_module_that_does_not_exist_is_not_found(name: str) -> None:
    finders = [*sys.meta_path]
    after_import(f"{name}_absent", pytest.fail)
    with pytest.raises(ModuleNotFoundError):
        import_module(f"{name}_absent")
    assert sys.meta_path == finders
