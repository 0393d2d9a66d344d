"""Types by name: from the cache if it is valid, else compiled; and the modules created from them."""

import codecs
import importlib
import struct
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import geometry_msgs
import pytest
import std_msgs
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import String

import genpy
from pipros.basics.errors import NotFound
from pipros.msg.compile.run import run
from pipros.msg.importing import load
from pipros.msg.importing.library import Library
from pipros.msg.importing.load import installed_md5, load_message_class, load_service_class
from pipros.msg.importing.star_names import imported_name, imported_names
from pipros.msg.language.spec import DefinitionError
from tests.support.definitions import Packages


@pytest.fixture
def library(packages: Packages, tmp_path: Path) -> Library:
    packages.write("robot/msg/Arm.msg", "float32 reach\nHand hand")
    packages.write("robot/msg/Hand.msg", "int8 fingers")
    packages.write("robot/srv/Wave.srv", "bool left\n---\n")
    packages.write("robot/msg/Broken.msg", "float32")
    packages.write("robot/srv/Broken.srv", "int8\n---\n")
    return Library(packages.find, str(tmp_path / "home" / "cache"))


def test_the_code_of_a_type_names_what_it_embeds(library: Library) -> None:
    code, embedded = library.code("msg", "robot/Arm")
    hand_code, _ = library.code("msg", "robot/Hand")
    hand = run(hand_code, {})["Hand"]

    assert run(code, {embedded["robot/Hand"]: hand})["Arm"](1.5, hand(3)).hand.fingers == 3


def test_a_mistake_is_raised_and_an_unknown_type_is_not_found(library: Library) -> None:
    for kind in ("msg", "srv"):
        with pytest.raises(DefinitionError, match=rf"Broken\.{kind}:1:1"):
            library.code(kind, "robot/Broken")
    with pytest.raises(NotFound):
        library.code("msg", "robot/Leg")


@pytest.mark.parametrize("name", ["String", "std_msgs/", "a/b/c", "../x/Y", "std_msgs/String;x"])
def test_a_malformed_type_name_is_refused_before_anything_is_imported(name: str) -> None:
    with pytest.raises(NotFound, match="must have the form package/Name"):
        load.load_message_class(name)


@pytest.mark.parametrize("name", ["os/path", "json/JSONDecoder", "nowhere/Thing"])
def test_a_type_outside_of_message_packages_is_not_imported(name: str) -> None:
    with pytest.raises(NotFound, match=r"there is no package|hides it"):
        load.load_message_class(name)


def test_services_and_messages_are_loaded_by_name() -> None:
    assert load.load_message_class("std_msgs/String")._type == "std_msgs/String"
    assert load.load_service_class("std_srvs/Empty")._type == "std_srvs/Empty"
    with pytest.raises(NotFound, match="there is no message Empty in package std_srvs"):
        load.load_message_class("std_srvs/Empty")


# Types by name, from definitions and from the modules that genpy generated.


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


# The names that modules generated by genpy import, besides their classes.


def messages_of(package: str) -> ModuleType:
    return importlib.import_module(f"{package}.msg")


EVERY_MODULE = {"codecs": codecs, "genpy": genpy, "struct": struct, "sys": sys, "python3": True}


@pytest.mark.parametrize("name", EVERY_MODULE)
def test_every_generated_module_imports_the_same_modules(name: str) -> None:
    assert imported_name(name) is EVERY_MODULE[name]


@pytest.mark.parametrize("name", ["os", "std_msgs"])
def test_other_names_are_attribute_errors(name: str) -> None:
    with pytest.raises(AttributeError, match=f"^{name}$"):
        imported_name(name)


def test_messages_without_embedded_ones_import_no_package() -> None:
    assert imported_names([String], messages_of) == EVERY_MODULE


def test_the_packages_of_embedded_messages_are_imported_at_any_depth() -> None:
    packages = {"geometry_msgs": geometry_msgs, "std_msgs": std_msgs}
    assert imported_names([String, PoseStamped], messages_of) == EVERY_MODULE | packages
