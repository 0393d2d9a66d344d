"""`rosrun image_transport republish`: images are compressed and decompressed between nodes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.environments import make_tool_folder, pipros_environment
from tests.support.nodes import MakeNode
from tests.support.processes import Processes
from tests.support.waiting import wait_until

Image: Any = load_message_class("sensor_msgs/Image")
CompressedImage: Any = load_message_class("sensor_msgs/CompressedImage")


@pytest.fixture
def processes(master: Master, tmp_path: Path) -> Iterator[Processes]:
    environment = pipros_environment(tmp_path, master.uri, make_tool_folder(tmp_path / "tools"))
    started = Processes(environment, tmp_path)
    yield started
    started.end_all()


def image() -> Any:
    made = Image(height=4, width=6, encoding="rgb8", step=18, data=bytes(range(72)))
    made.header.frame_id = "camera"
    return made


def send_until_all_arrive(node: Node, topic: str, *got: list[Any]) -> None:
    """Publish the image repeatedly, because programs connect only when they are ready, in any order."""
    publisher = node.advertise(topic, Image, queue_size=1)

    def arrived() -> bool:
        publisher.publish(image())
        return all(got)

    wait_until(arrived, 60, "images")


def test_images_are_converted_to_png_and_back(processes: Processes, make_node: MakeNode) -> None:
    node, got, packed = make_node("camera"), list[Any](), list[Any]()
    node.params.set("/small/compressed/format", "png")
    node.subscribe("/back", Image, got.append)
    node.subscribe("/small/compressed", CompressedImage, packed.append)
    run = ("rosrun", "image_transport", "republish")
    processes.start(*run, "raw", "in:=/camera/image", "compressed", "out:=/small")
    processes.start(*run, "compressed", "in:=/small", "raw", "out:=/back")

    send_until_all_arrive(node, "/camera/image", got, packed)

    assert (got[0].encoding, got[0].width, got[0].step) == ("rgb8", 6, 18)
    assert bytes(got[0].data) == image().data
    assert got[0].header.frame_id == "camera"
    assert packed[0].format == "rgb8; png compressed bgr8"


def test_a_raw_image_is_republished_in_every_transport(processes: Processes, make_node: MakeNode) -> None:
    node, got, packed = make_node("camera"), list[Any](), list[Any]()
    node.subscribe("/out", Image, got.append)
    node.subscribe("/out/compressed", CompressedImage, packed.append)
    processes.start("rosrun", "image_transport", "republish", "raw", "in:=/camera/image", "out:=/out")

    send_until_all_arrive(node, "/camera/image", got, packed)

    assert bytes(got[0].data) == image().data
    assert packed[0].format == "rgb8; jpeg compressed bgr8"


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ([], 0, "Usage: "),
        (
            ["theora", "in:=/a", "raw", "out:=/b"],
            1,
            "'theora': it must be one of raw, compressed, compressed",
        ),
        (["raw", "in:=/a", "theora", "out:=/b"], 1, "it must be one of raw, compressed, compressedDepth\n"),
    ],
)
def test_impossible_conversions_are_reported(
    processes: Processes, arguments: list[str], code: int, text: str
) -> None:
    ended = processes.run("rosrun", "image_transport", "republish", *arguments)

    assert ended.returncode == code
    assert text in "\n".join([*ended.stdout, *ended.stderr, ""])


def test_a_wrong_parameter_ends_the_program(processes: Processes, make_node: MakeNode) -> None:
    make_node("setter").params.set("/b/compressed/jpeg_quality", 400)

    ended = processes.run("rosrun", "image_transport", "republish", "raw", "in:=/a", "compressed", "out:=/b")

    assert ended.returncode == 1
    assert "jpeg_quality must be an integer from 1 to 100, got 400" in ended.output


def test_the_transports_are_listed(processes: Processes) -> None:
    ended = processes.run("rosrun", "image_transport", "list_transports")

    assert ended.stdout[:4] == [
        "Declared transports:",
        *(f"image_transport/{name}" for name in ("raw", "compressed", "compressedDepth")),
    ]
