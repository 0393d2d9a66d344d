"""A type name chosen by a peer imports only modules of message packages."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Empty

from pipros.basics.env import Environment
from pipros.basics.errors import NotFound
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.importing.load import installed_md5
from pipros.node import Node
from tests.support.ros import RosSystem

TEXT_OF_THIS = "Beautiful is better than ugly"


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on the path with a module, a package and a namespace package that report their execution."""
    loud = "raise AssertionError('was imported')"
    (tmp_path / "loud_module.py").write_text(loud)
    (tmp_path / "loud_package" / "msg").mkdir(parents=True)
    (tmp_path / "loud_package" / "__init__.py").write_text(loud)
    (tmp_path / "loud_package" / "msg" / "__init__.py").write_text("Foo = 1")
    (tmp_path / "quiet_package" / "msg").mkdir(parents=True)
    (tmp_path / "quiet_package" / "msg" / "__init__.py").write_text(loud)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] in ("made_msgs", "quiet_package")]:
        del sys.modules[name]


@pytest.mark.parametrize("package", ["loud_module", "loud_package", "quiet_package", "this", "antigravity"])
def test_modules_that_are_not_message_packages_are_not_imported(modules: Path, package: str) -> None:
    for load in (load_message_class, load_service_class):
        with pytest.raises(NotFound, match=f"there is no package {package}"):
            load(f"{package}/Foo")
    assert package not in sys.modules


def test_classes_that_genpy_generated_are_found_on_the_path(modules: Path) -> None:
    for kind, name in (("msg", "Foo"), ("srv", "Bar")):
        (modules / "made_msgs" / kind).mkdir(parents=True)
        (modules / "made_msgs" / kind / "__init__.py").write_text(f"from ._{name} import *\n")
        (modules / "made_msgs" / kind / f"_{name}.py").write_text(f"class {name}:\n    _md5sum = '0'\n")

    assert load_message_class("made_msgs/Foo").__name__ == "Foo"
    assert load_service_class("made_msgs/Bar").__name__ == "Bar"
    with pytest.raises(NotFound):
        load_message_class("made_msgs/Missing")


def test_the_md5_sum_of_an_installed_type_is_known_without_an_import(modules: Path) -> None:
    sources = {
        "_Foo": f'class Foo:\n  _md5sum = "{"a" * 32}"\nraise AssertionError("was imported")',
        "_Bar": "class Bar: pass",
    }
    for name, source in sources.items():
        (modules / "loud_package" / "msg" / f"{name}.py").write_text(source)
    names = ["std_msgs/String", "loud_package/Foo", "loud_package/Bar", "loud_package/None", "this/Foo", "x"]

    assert [installed_md5(name) for name in names] == [
        "992ce8a1687cec8c8bd883ec73ca41d1",
        "a" * 32,
        *[None] * 4,
    ]
    assert not {"loud_package", "this"} & set(sys.modules)


def test_a_class_that_is_not_a_message_is_not_returned(modules: Path) -> None:
    (modules / "made_msgs" / "msg").mkdir(parents=True)
    (modules / "made_msgs" / "msg" / "__init__.py").write_text("Foo = 1\n")
    (modules / "made_msgs" / "msg" / "_Foo.py").write_text("")

    with pytest.raises(NotFound):
        load_message_class("made_msgs/Foo")


def test_tools_do_not_import_modules_named_by_a_peer(ros: RosSystem) -> None:
    """`import this` would print a poem."""
    message_class = message_classes_from_text("this/Foo", "string data")["this/Foo"]
    service_class: Any = type(
        "Foo",
        (),
        {"_type": "this/Foo", "_md5sum": "0" * 32, "_request_class": Empty, "_response_class": Empty},
    )
    with (
        Master(host="127.0.0.1", port=ros.port) as master,
        Node("peer", environment=Environment(master_uri=master.uri)) as node,
    ):
        node.advertise("/wisdom", message_class, latch=True).publish(message_class("heard"))
        node.serve("/wise", service_class, lambda _: Empty())
        outputs = {
            command: ros.pipros.run(*command.split()).output
            for command in (
                "rostopic echo -n1 /wisdom",
                "rostopic pub -1 /wisdom this/Foo {}",
                "rosservice call /wise {}",
                "rosservice args /wise",
                "pipros-complete 3 rosservice call /wise",
                "pipros-complete 4 rostopic pub /wisdom this/Foo",
            )
        }

    assert "heard" in outputs["rostopic echo -n1 /wisdom"]
    assert [command for command, output in outputs.items() if TEXT_OF_THIS in output] == []
    assert "Unable to load type [this/Foo]" in outputs["rosservice call /wise {}"]
