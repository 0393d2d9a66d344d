"""Types by name: from the cache if it is valid, else compiled; and the modules created from them."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.compile.run import run
from pipros.msg.importing import load
from pipros.msg.importing.library import Library
from pipros.msg.importing.modules import interface_spec, type_spec
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

    arm = run(code, {embedded["robot/Hand"]: hand})["Arm"]

    assert arm(1.5, hand(3)).hand.fingers == 3


def test_a_second_library_finds_the_code_in_the_cache(
    library: Library, packages: Packages, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = library.code("msg", "robot/Hand")
    second = Library(packages.find, str(tmp_path / "home" / "cache"))
    monkeypatch.setattr(second, "_compile", None)  # would be called without the cache

    assert second.code("msg", "robot/Hand") == first


def test_without_a_cache_folder_types_are_compiled(packages: Packages, library: Library) -> None:
    assert Library(packages.find, None).code("srv", "robot/Wave")[1] == {}
    assert library.code("srv", "robot/Wave")[1] == {}


def test_a_mistake_is_raised_and_an_unknown_type_is_not_found(library: Library) -> None:
    for kind in ("msg", "srv"):
        with pytest.raises(DefinitionError, match=rf"Broken\.{kind}:1:1"):
            library.code(kind, "robot/Broken")
    with pytest.raises(NotFound):
        library.code("msg", "robot/Leg")


def test_a_module_exists_for_packages_with_definitions(library: Library) -> None:
    spec = interface_spec(library, "robot", "msg", None)

    assert spec is not None
    assert spec.name == "robot.msg"
    assert interface_spec(library, "nowhere", "msg", None) is None
    assert type_spec(library, "robot", "msg", "_Arm") is None  # robot.msg was not imported


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
