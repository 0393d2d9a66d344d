"""What Linux has and Windows or macOS lack is not needed to import pipros."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY
from tests.support.without_posix import PACKAGES, run_without_posix

SRC = REPOSITORY / "src"
FACADES = [package for package in PACKAGES if package != "pipros"]

NEED_PYKDL = {"tf2_kdl", "tf2_kdl.tf2_kdl"}
"""They register the types of PyKDL, and say so where it is missing: PyPI does not have it."""

IMPORT_ALL = """
import importlib, json, sys, traceback
failed = {}
for name in json.loads(MODULES_AS_JSON):
    try:
        importlib.import_module(name)
    except Exception:
        failed[name] = traceback.format_exc().strip().splitlines()[-3:]
print(json.dumps(failed))
"""


def modules_of(folder: Path) -> list[str]:
    files = sorted(file for file in folder.rglob("*.py") if "share" not in file.relative_to(SRC).parts)
    names = [".".join(file.relative_to(SRC).with_suffix("").parts) for file in files]
    return [name.removesuffix(".__init__") for name in names if not name.endswith("__main__")]


@pytest.mark.parametrize("packages", [["pipros"], FACADES], ids=["pipros", "facades"])
def test_every_module_can_be_imported_without_what_only_posix_has(packages: list[str]) -> None:
    """In one process for many modules: the failed import of one does not disturb the others."""
    modules = [module for package in packages for module in modules_of(SRC / package)]
    assert set(packages) <= set(modules)
    modules = [module for module in modules if module not in NEED_PYKDL]
    failed = run_without_posix(f"MODULES_AS_JSON = {json.dumps(modules)!r}\n{IMPORT_ALL}")
    assert json.loads(failed) == {}
