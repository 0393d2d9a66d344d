"""Peers and bags with types that have the names of well-known ones, but other fields."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

import pytest

from pipros.basics.env import Environment
from pipros.msg.class_finder import ClassFinder
from pipros.msg.dynamic import message_classes_from_text
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.images import image_file
from pipros_tools.cli.rostopic.delay import Delays
from tests.support.constants import Constants
from tests.support.ros import RosSystem

OTHER_HEADER = f"Header header\n{'=' * 80}\nMSG: std_msgs/Header\nstring stamp\n"


@pytest.fixture
def liar(ros: RosSystem) -> Iterator[Node]:
    ros.serve_master()
    with Node("liar", environment=Environment(master_uri=ros.master_uri)) as node:
        yield node


def test_rosconsole_names_a_log_of_another_definition(ros: RosSystem, liar: Node) -> None:
    log = message_classes_from_text("rosgraph_msgs/Log", "string level\n")["rosgraph_msgs/Log"]
    liar.advertise("/rosout", log, latch=True).publish(log("x"))
    echo = ros.pipros.run("rosconsole", "echo")
    assert echo.returncode == 1
    assert "Traceback" not in echo.output
    assert "/liar publishes [rosgraph_msgs/Log/" in echo.output


def test_rostopic_delay_needs_the_stamp_of_a_header(capsys: pytest.CaptureFixture[str]) -> None:
    stamped = message_classes_from_text("a/Stamped", OTHER_HEADER)["a/Stamped"]
    assert stamped._has_header
    raw = AnyMsg(b"\1\0\0\0x")
    fields = {"type": "a/Stamped", "md5sum": stamped._md5sum, "message_definition": OTHER_HEADER}
    raw._connection_header = fields
    Delays().add(raw, 1)
    assert "msg does not have header" in capsys.readouterr().err


def test_definitions_that_change_for_ever_take_bounded_memory(constants: Constants) -> None:
    constants(DEFINITION_CACHE_BYTES=200000)
    finder = ClassFinder()
    found = []
    for number in range(100):
        text = f"int32 field_{number}\n"
        found.append(weakref.ref(finder.find("a/T", f"{number:032}", text)))
    gc.collect()
    assert sum(each() is not None for each in found) <= 10
    assert finder.find("a/T", f"{99:032}", text) is found[-1]()


@pytest.mark.parametrize("name", ["sensor_msgs/Image", "sensor_msgs/CompressedImage"])
def test_an_image_of_another_definition_is_not_exported(name: str) -> None:
    image = message_classes_from_text(name, "string encoding\n")[name]("rgb8")
    with pytest.raises(BagError, match="must equal an installed package's"):
        image_file(image)
