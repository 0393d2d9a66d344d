"""Names that a module binds by star import, and imports on first access."""

import importlib
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from pipros.basics.after_import import after_import
from pipros.basics.shared_names import share_names
from tests.support.lacks import is_simulated

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


@pytest.mark.parametrize(("module", "names"), [
    ("OWN = 1\nstar_names(__name__, 'wave', hidden='json lazy_names star_names')", {"OWN", "wave"}),
    ("OWN = OTHER = 1\n__all__ = ['OWN']\nstar_names(__name__, 'wave.nothing:open')", {"OWN"}),
    ("__all__ = []\nstar_names(__name__, 'wave:open colorsys:hls_to_rgb')", {"open", "hls_to_rgb"}),
    ("__all__ = []\nstar_names(__name__, 'xml.dom sounds=wave play=wave:open')", {"dom", "sounds", "play"}),
    ("__all__ = []\nstar_names(__name__, 'no_such_library')", set()),
    ("__getattr__, __dir__ = lazy_names(__name__, {'hls_to_rgb': 'colorsys'})\n"
        "star_names(__name__, hidden='json lazy_names star_names')", {"hls_to_rgb"}),
], indirect=["module"])  # fmt: skip
def test_a_star_import_binds_the_listed_names(module: ModuleType, names: set[str]) -> None:
    assert (star_imported(module.__name__).keys(), sorted(names)) == (names, module.__all__)


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


@pytest.mark.parametrize(("statement", "not_imported"), [
    ("import actionlib", {"actionlib.msg"}), ("import rosnode", {"rosgraph", "rostopic", "optparse"}),
    ("import rosmsg", {"optparse", "roslib", "rospkg"}),
    ("import rospy", {"pickle", "rosgraph", "rospkg", "xmlrpc.client"}),
    ("from geometry_msgs.msg import Pose", {"genpy", "std_msgs.msg"}),
])  # fmt: skip
def test_plain_imports_do_not_import_what_star_imports_bind(statement: str, not_imported: set[str]) -> None:
    program = f"import sys\n{statement}\nprint(*sys.modules)"
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    assert not_imported & set(ran.stdout.split()) == set()


@pytest.mark.parametrize(("before", "is_enabled", "is_spared"), [
    ("from math import pi; import json", True, True), ("gc.disable()", False, True),
    ("value = type('A', (), {})(); value.self = value", True, False),
    ("def load(): import rospy\nload()", True, False),
])  # fmt: skip
def test_the_collector_is_spared_what_rospy_imports_but_no_value_of_the_program(
    before: str, is_enabled: bool, is_spared: bool
) -> None:
    program = (
        f"import gc, weakref\n{before}\nimport rospy\n"
        "seen = weakref.ref(value) if 'value' in dir() else id\nvalue = None\ngc.collect()\n"
        "print(gc.isenabled(), gc.get_freeze_count() > 10_000, seen is id or seen() is None)"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    is_spared = is_spared and not is_simulated()  # a function of the simulation imports all modules
    assert (ran.stdout, ran.stderr) == (f"{is_enabled} {is_spared} True\n", "")


def test_a_module_of_a_package_is_imported_when_its_name_is_first_used(tmp_path: Path, monkeypatch) -> None:
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


# Functions that are called after the import of a module.


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


# Module attributes that read and set the attributes of an object.


def test_a_module_reads_and_sets_attributes_of_an_object_and_its_parts(monkeypatch) -> None:
    module: Any = ModuleType("sharing")
    monkeypatch.setitem(sys.modules, "sharing", module)
    owner = SimpleNamespace(uri="a", hooks=SimpleNamespace(client=[1]))
    share_names("sharing", owner, {"_uri": "uri", "_client": "hooks.client"})
    owner.hooks = SimpleNamespace(client=[2])
    assert (module._uri, module._client) == ("a", [2])
    module._uri, module._client = "b", [3]
    assert (owner.uri, owner.hooks.client) == ("b", [3])
