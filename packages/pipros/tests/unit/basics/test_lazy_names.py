"""Names that a module binds by star import, and imports on first access."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

HEAD = (
    "from typing import Any\nimport json\n"
    "from pipros.basics.lazy_names import lazy_names, star_names\n_hidden = 1\n"
)


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> ModuleType:
    """The module whose source, after `HEAD`, is the parameter of the test."""
    (tmp_path / "starred.py").write_text(HEAD + request.param)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "starred", raising=False)
    return importlib.import_module("starred")


def star_imported(name: str) -> dict[str, object]:
    namespace: dict[str, object] = {}
    exec(f"from {name} import *", namespace)  # noqa: S102
    del namespace["__builtins__"]
    return namespace


@pytest.mark.parametrize(
    ("module", "names"),
    [
        ("OWN = 1\nstar_names(__name__, 'wave', hidden='json lazy_names star_names')", {"OWN", "wave"}),
        ("OWN = OTHER = 1\n__all__ = ['OWN']\nstar_names(__name__, 'wave.nothing:open')", {"OWN"}),
        ("__all__ = []\nstar_names(__name__, 'wave:open colorsys:hls_to_rgb')", {"open", "hls_to_rgb"}),
        (
            "__all__ = []\nstar_names(__name__, 'xml.dom sounds=wave play=wave:open')",
            {"dom", "sounds", "play"},
        ),
        ("__all__ = []\nstar_names(__name__, 'no_such_library')", set()),
        (
            "__getattr__, __dir__ = lazy_names(__name__, {'hls_to_rgb': 'colorsys'})\n"
            "star_names(__name__, hidden='json lazy_names star_names')",
            {"hls_to_rgb"},
        ),
    ],
    indirect=["module"],
)
def test_a_star_import_binds_the_listed_names(module: ModuleType, names: set[str]) -> None:
    assert star_imported(module.__name__).keys() == names
    assert sorted(names) == module.__all__


@pytest.mark.parametrize("module", ["star_names(__name__, 'opening=wave:open sounds=wave')"], indirect=True)
def test_the_names_are_attributes_too(module: ModuleType) -> None:
    wave = importlib.import_module("wave")
    assert module.sounds is wave
    assert module.opening is wave.open
    with pytest.raises(AttributeError, match="module 'starred' has no attribute 'nothing'"):
        _ = module.nothing


@pytest.mark.parametrize("module", ["star_names(__name__, 'no_such_library')"], indirect=True)
def test_a_library_that_is_not_installed_is_a_missing_attribute(module: ModuleType) -> None:
    with pytest.raises(AttributeError, match="cannot import 'no_such_library': No module named"):
        _ = module.no_such_library


@pytest.mark.parametrize(
    ("statement", "not_imported"),
    [
        ("import actionlib", {"actionlib.msg"}),
        ("import rosnode", {"rosgraph", "rostopic", "optparse"}),
        ("import rosmsg", {"optparse", "roslib", "rospkg"}),
        ("import rospy", {"pickle", "rosgraph", "rospkg", "xmlrpc.client"}),
        ("from geometry_msgs.msg import Pose", {"genpy", "std_msgs.msg"}),
    ],
)
def test_plain_imports_do_not_import_what_star_imports_bind(statement: str, not_imported: set[str]) -> None:
    program = f"import sys\n{statement}\nprint(*sys.modules)"
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    assert not_imported & set(ran.stdout.split()) == set()


def test_a_module_of_a_package_is_imported_when_its_name_is_first_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "with_submodules"
    folder.mkdir()
    (folder / "__init__.py").write_text(
        HEAD + "__getattr__, __dir__ = lazy_names(__name__, {}, submodules=('late',))\n"
    )
    (folder / "late.py").write_text("value = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    package = importlib.import_module("with_submodules")
    assert "late" in dir(package)
    assert "with_submodules.late" not in sys.modules
    assert package.late.value == 1
    assert not hasattr(package, "later")
