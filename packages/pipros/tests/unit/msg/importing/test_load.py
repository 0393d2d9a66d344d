"""Types by name, from definitions and from the modules that genpy generated."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.importing.load import installed_md5, load_message_class, load_service_class

MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"
GENERATED = f'class Arm:\n  _md5sum = "{MD5}"\n  _type = "made_by_genpy/Arm"\n'


class Folder:
    """A folder on `ROS_PACKAGE_PATH` and on Python's path."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def write(self, path: str, text: str = "") -> None:
        file = self.path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def generate(self, package: str, code: str = GENERATED, start: str = "from ._Arm import *\n") -> None:
        """Write the modules of a message as genpy does."""
        self.write(f"{package}/__init__.py")
        self.write(f"{package}/msg/__init__.py", start)
        self.write(f"{package}/msg/_Arm.py", code)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("made_by_genpy", "made_by_genpy.msg", "made_by_genpy.msg._Arm"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return Folder(tmp_path)


def test_md5_sums_are_those_of_installed_definitions(folder: Folder) -> None:
    assert installed_md5("std_msgs/String") == MD5
    assert installed_md5("std_msgs/Nothing") is None
    assert installed_md5("String") is None
    folder.write("defined/package.xml", "<package/>")
    folder.write("defined/msg/Broken.msg", "int32")
    assert installed_md5("defined/Broken") is None


def test_md5_sums_of_generated_modules_are_read_without_an_import(folder: Folder) -> None:
    folder.generate("made_by_genpy")
    assert installed_md5("made_by_genpy/Arm") == MD5
    assert installed_md5("made_by_genpy/Leg") is None
    assert "made_by_genpy" not in sys.modules


@pytest.mark.parametrize("code", ["", '_md5sum = "992"\n', "#" * 20_000 + GENERATED])
def test_modules_without_an_md5_sum_in_their_first_lines_have_none(folder: Folder, code: str) -> None:
    folder.generate("made_by_genpy", code)
    assert installed_md5("made_by_genpy/Arm") is None


def test_modules_in_an_archive_have_no_known_md5_sum(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    archive = folder.path / "modules.zip"
    with zipfile.ZipFile(archive, "w") as writing:
        for name, text in (("__init__", ""), ("msg/__init__", ""), ("msg/_Arm", GENERATED)):
            writing.writestr(f"made_by_genpy/{name}.py", text)
    monkeypatch.syspath_prepend(archive)
    assert installed_md5("made_by_genpy/Arm") is None


def test_generated_classes_are_loaded(folder: Folder) -> None:
    folder.generate("made_by_genpy")
    assert load_message_class("made_by_genpy/Arm")._md5sum == MD5
    with pytest.raises(NotFound, match="made_by_genpy"):
        load_message_class("made_by_genpy/Leg")
    with pytest.raises(NotFound, match="made_by_genpy"):
        load_service_class("made_by_genpy/Arm")


def test_a_generated_package_that_lacks_a_dependency_names_it(folder: Folder) -> None:
    folder.generate("made_by_genpy", start="import no_such_dependency\n")
    with pytest.raises(ModuleNotFoundError, match="no_such_dependency"):
        load_message_class("made_by_genpy/Arm")


def test_other_modules_are_not_taken_for_packages(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    folder.write("made_by_genpy.py", "raise RuntimeError")
    with pytest.raises(NotFound, match="made_by_genpy"):
        load_message_class("made_by_genpy/Arm")

    monkeypatch.setitem(sys.modules, "made_by_genpy", ModuleType("made_by_genpy"))  # without a spec
    with pytest.raises(NotFound, match="made_by_genpy"):
        load_message_class("made_by_genpy/Arm")


@pytest.mark.parametrize("package", ["this", "java"])
def test_packages_with_reserved_names_are_not_imported(folder: Folder, package: str) -> None:
    folder.write(f"{package}/package.xml", "<package/>")
    folder.write(f"{package}/msg/Arm.msg", "int32 x")
    sys.path.remove(str(folder.path))  # only on ROS_PACKAGE_PATH
    with pytest.raises(NotFound, match=f"defines {package}/Arm, but the Python package {package} hides it"):
        load_message_class(f"{package}/Arm")
    assert package not in sys.modules
