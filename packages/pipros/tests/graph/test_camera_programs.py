"""usb_cam with a video file as its device, image_view, and image_transport. Not tested with a real camera."""

import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy
import pytest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from pipros.master.master import Master
from pipros.node import Node
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.environments import make_tool_folder, pipros_environment
from tests.support.nodes import Inbox, MakeNode
from tests.support.page import Page
from tests.support.processes import Processes
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# usb_cam with a video file as its device, and image_view. Not tested with a real camera.


WIDTH, HEIGHT = 64, 48


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """A video of 2,000 red pictures."""
    path = tmp_path / "video.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (WIDTH, HEIGHT))
    picture = numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8)
    picture[:, :, 2] = 255  # OpenCV's order is blue, green, red
    for _ in range(2000):
        writer.write(picture)
    writer.release()
    return path


def test_a_video_is_published_with_its_calibration(ros: RosSystem, video: Path) -> None:
    ros.serve_master()
    images, infos = Inbox(), Inbox()
    with ros.node("viewer") as node:
        node.subscribe("/usb_cam/image_raw", Image, images)
        node.subscribe("/usb_cam/camera_info", CameraInfo, infos)
        camera = ros.pipros.start(
            "rosrun", "usb_cam", "usb_cam_node", f"_video_device:={video}", "_camera_frame_id:=lens"
        )
        camera.wait_for(r"Starting 'head_camera' \(\S+video.avi\) at 640x480 via OpenCV \(mjpeg\) at 30 FPS")
        wait_until(lambda: images.messages and infos.messages, 30, lambda: camera.output)
        image, info = images.messages[0], infos.messages[0]
        assert (image.width, image.height, image.encoding, image.step) == (WIDTH, HEIGHT, "rgb8", 3 * WIDTH)
        assert image.header.frame_id == info.header.frame_id == "lens"
        assert list(image.data[:3]) == pytest.approx([255, 0, 0], abs=3)
        assert (info.width, info.height) == (WIDTH, HEIGHT)
        for service in ("stop_capture", "start_capture"):
            assert ros.pipros.run("rosservice", "call", f"/usb_cam/{service}").returncode == 0
        seen = len(images.messages)
        wait_until(lambda: len(images.messages) > seen, 30, "another image")
        camera.press_ctrl_c(code=0)


def test_a_missing_camera_and_an_unknown_format_are_errors(ros: RosSystem, video: Path) -> None:
    ros.serve_master()
    missing = ros.pipros.run("rosrun", "usb_cam", "usb_cam_node", "_video_device:=/dev/none")
    missing.check(1, "cannot open the camera /dev/none")
    unknown = ros.pipros.run(
        "rosrun", "usb_cam", "usb_cam_node", f"_video_device:={video}", "_pixel_format:=h264"
    )
    assert unknown.returncode == 1
    assert (
        "pixel_format must be one of yuyv, uyvy, mjpeg, rgb24, grey, yuvmono10, got 'h264'" in unknown.output
    )


def test_the_node_ends_with_the_video(ros: RosSystem, video: Path) -> None:
    ros.serve_master()
    camera = ros.pipros.start(
        "rosrun", "usb_cam", "usb_cam_node", f"_video_device:={video}", "_framerate:=1000000"
    )
    camera.wait_for("cannot read an image from", 60)
    camera.wait()


def test_image_view_opens_the_page_at_its_topic(ros: RosSystem) -> None:
    ros.serve_master()
    for arguments, place in (
        (["image:=/usb_cam/image_raw"], "images/%2Fusb_cam%2Fimage_raw"),
        (["image:=/cam", "_image_transport:=compressed", "_autosize:=true"], "images/%2Fcam%2Fcompressed"),
    ):
        shown = ros.pipros.start("rosrun", "image_view", "image_view", "--no-browser", *arguments)
        assert Page.of(shown).place == place


def test_one_command_installs_all_that_the_node_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("usb_cam", "pipros_libraries.vision.capture"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    for name in ("numpy", "cv2"):
        monkeypatch.setitem(sys.modules, name, None)

    with pytest.raises(SystemExit, match=r"ERROR: usb_cam needs OpenCV, .*pip install .*\[vision\]"):
        runpy.run_path(str(SHARED_PACKAGES / "usb_cam" / "scripts" / "usb_cam_node"), run_name="__main__")


# `rosrun image_transport republish`: images are compressed and decompressed between nodes.


@pytest.fixture
def transport_processes(master: Master, tmp_path: Path) -> Iterator[Processes]:
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


def test_images_are_converted_to_png_and_back(transport_processes: Processes, make_node: MakeNode) -> None:
    node, got, packed = make_node("camera"), list[Any](), list[Any]()
    node.params.set("/small/compressed/format", "png")
    node.subscribe("/back", Image, got.append)
    node.subscribe("/small/compressed", CompressedImage, packed.append)
    run = ("rosrun", "image_transport", "republish")
    transport_processes.start(*run, "raw", "in:=/camera/image", "compressed", "out:=/small")
    transport_processes.start(*run, "compressed", "in:=/small", "raw", "out:=/back")

    send_until_all_arrive(node, "/camera/image", got, packed)

    assert (got[0].encoding, got[0].width, got[0].step) == ("rgb8", 6, 18)
    assert (bytes(got[0].data), got[0].header.frame_id) == (image().data, "camera")
    assert packed[0].format == "rgb8; png compressed bgr8"


def test_raw_images_are_republished_everywhere(transport_processes: Processes, make_node: MakeNode) -> None:
    node, got, packed = make_node("camera"), list[Any](), list[Any]()
    node.subscribe("/out", Image, got.append)
    node.subscribe("/out/compressed", CompressedImage, packed.append)
    transport_processes.start(
        "rosrun", "image_transport", "republish", "raw", "in:=/camera/image", "out:=/out"
    )

    send_until_all_arrive(node, "/camera/image", got, packed)

    assert bytes(got[0].data) == image().data
    assert packed[0].format == "rgb8; jpeg compressed bgr8"


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ([], 0, "Usage: "),
        (
            ["theora", "in:=/a", "raw", "out:=/b"], 1,
            "'theora': it must be one of raw, compressed, compressed",
        ),
        (["raw", "in:=/a", "theora", "out:=/b"], 1, "it must be one of raw, compressed, compressedDepth\n"),
    ],
)  # fmt: skip
def test_impossible_conversions_are_reported(transport_processes, arguments, code: int, text: str) -> None:
    ended = transport_processes.run("rosrun", "image_transport", "republish", *arguments)

    assert ended.returncode == code
    assert text in "\n".join([*ended.stdout, *ended.stderr, ""])


def test_a_wrong_parameter_ends_the_program(transport_processes: Processes, make_node: MakeNode) -> None:
    make_node("setter").params.set("/b/compressed/jpeg_quality", 400)

    ended = transport_processes.run(
        "rosrun", "image_transport", "republish", "raw", "in:=/a", "compressed", "out:=/b"
    )

    ended.check(1, "jpeg_quality must be an integer from 1 to 100, got 400")


def test_the_transports_are_listed(transport_processes: Processes) -> None:
    ended = transport_processes.run("rosrun", "image_transport", "list_transports")

    assert ended.stdout[:4] == [
        "Declared transports:",
        *(f"image_transport/{name}" for name in ("raw", "compressed", "compressedDepth")),
    ]
