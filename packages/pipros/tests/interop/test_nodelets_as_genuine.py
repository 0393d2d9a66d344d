"""Nodelets, and nodes that send and look at images, of pipros and genuine ones in all combinations."""

import base64
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped
from PIL import Image as Pictures
from sensor_msgs.msg import Image

from pipros.basics.env import Environment
from pipros.msg import load_service_class
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_libraries.pictures.codecs import PillowCodec
from pipros_libraries.vision.compressed_images import decompressed
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.environments import EXAMPLES, SOURCE_PATH
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.same_results import printed
from tests.support.waiting import wait_until


@pytest.mark.parametrize("manager_side", ["pipros", "genuine"])
@pytest.mark.parametrize("loader_side", ["pipros", "genuine"])
def test_a_nodelet_has_the_same_names_and_ends_with_its_loader(ros, manager_side, loader_side: str) -> None:
    ros.serve_master()
    program = {"pipros": ["rosrun", "nodelet", "nodelet"], "genuine": ["/usr/lib/nodelet/nodelet"]}
    manager = getattr(ros, manager_side).start(*program[manager_side], "manager", "__name:=mgr", "__ns:=/r")
    loader = getattr(ros, loader_side).start(
        *program[loader_side],
        *("load", "image_proc/debayer", "mgr", "__ns:=/r", "__name:=d", "image_color:=/colors"),
    )
    names, inbox = load_service_class("nodelet/NodeletList"), Inbox()
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        listed = node.client("/r/mgr/list", names)
        assert listed.wait_until_available(60, pause=node.clock.sleep, report=print)
        wait_until(lambda: listed.call(names._request_class()).nodelets == ["/r/d"], 60)
        ros.wait_for_publisher("/colors")
        assert (ros.publishers("/colors"), ros.publishers("/r/image_mono")) == (["/r/mgr"], ["/r/mgr"])
        assert ros.subscribers("/r/image_raw") == []
        wait_until(lambda: node.params.has("/r/d/debayer"), 60)
        assert node.params.get("/r/d/debayer") == 0
        node.subscribe("/colors", Image, inbox)
        camera = node.advertise("/r/image_raw", Image)
        row, next_row = bytes([200, 100] * 4), bytes([100, 50] * 4)
        mosaic = Image(height=8, width=8, step=8, encoding="bayer_rggb8", data=(row + next_row) * 4)

        def sent() -> bool:
            camera.publish(mosaic)
            return bool(inbox.messages)

        wait_until(sent, 60)
        image = inbox.messages[0]
        assert (image.encoding, image.data) == ("bgr8", bytes([50, 100, 200] * 64))
        loader.press_ctrl_c()
        assert loader.wait() == 0
        wait_until(lambda: listed.call(names._request_class()).nodelets == [])
    assert manager.is_running


# image_transport compared with the genuine one, and images of OpenCV with those of Pillow.
COMPRESS = Path(__file__).parent / "programs" / "compress_by_opencv.py"


@pytest.mark.parametrize("out_transport", [["raw"], []])
def test_raw_images_are_forwarded_as_by_genuine(plain_ros: RosSystem, out_transport: list[str]) -> None:
    plain_ros.serve_master()
    got: dict[str, list[AnyMsg]] = {"genuine": [], "pipros": []}
    environment = Environment(master_uri=plain_ros.pipros.environment["ROS_MASTER_URI"])
    with Node("camera", environment=environment) as node:
        publisher = node.advertise("/camera/image", Image, queue_size=1)
        for side, messages in got.items():
            node.subscribe(f"/{side}", AnyMsg, messages.append)
            arguments = ("raw", "in:=/camera/image", *out_transport, f"out:=/{side}")
            getattr(plain_ros, side).start_node("image_transport", "republish", *arguments)
        image = Image(height=2, width=3, encoding="rgb8", step=9, data=bytes(range(18)))
        image.header.frame_id = "camera"

        def arrived() -> bool:
            publisher.publish(image)
            return all(got.values())

        wait_until(arrived, 60, "an image of either side")

    genuine, ours = (messages[0] for messages in got.values())
    assert ours.header["type"] == genuine.header["type"] == "sensor_msgs/Image"
    assert ours.header["md5sum"] == genuine.header["md5sum"]
    # The first field is the number of the message.
    assert ours.body[4:] == genuine.body[4:]


def test_pillow_reads_what_opencv_compressed() -> None:
    environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": SOURCE_PATH}
    said = printed("/usr/bin/python3", COMPRESS, environment=environment)

    for name, (kind, data, image) in json.loads(said).items():
        ours, _ = decompressed(kind, base64.b64decode(data), PillowCodec(Pictures))
        # JPEG values may differ by rounding errors.
        limit = 0 if "png" in kind else 4
        assert np.abs(ours.astype(int) - np.array(image)).max() <= limit * (256 if "16;" in name else 1), name


# A camera and a node that looks at its images, with the libraries of either side.
PROGRAMS = Path(__file__).parent / "programs"
SIDES = ("pipros", "genuine")


def test_images_of_either_side_are_detected_on_either_side(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()
    spots: dict[str, list[Any]] = {}
    environment = Environment(master_uri=plain_ros.pipros.environment["ROS_MASTER_URI"])
    with Node("listener", environment=environment) as node:
        for camera in SIDES:
            topics = [f"image_raw:=/{camera}/image_raw", f"camera_info:=/{camera}/camera_info"]
            getattr(plain_ros, camera).start("python3", PROGRAMS / "send_camera.py", *topics)
            for finder in SIDES:
                topic = f"/{camera}/seen_by_{finder}"
                spots[topic] = []
                node.subscribe(topic, PointStamped, spots[topic].append)
                spot = f"spot:={topic}"
                getattr(plain_ros, finder).start("python3", PROGRAMS / "find_spot.py", *topics, spot)

        for topic, found in spots.items():
            wait_until(partial(len, found), 120, f"a spot on {topic}")

    points = [found[0].point for found in spots.values()]
    for found in spots.values():
        assert found[0].header.frame_id == "camera_optical"
    expected = points[-1]  # the genuine result for the genuine camera
    assert 0.1 < expected.x < 0.3
    for point in points:
        assert (point.x, point.y, point.z) == pytest.approx((expected.x, expected.y, expected.z), abs=1e-9)


# C++ nodes and nodelets that Debian installed, started by pipros' tools without any variable.
LAUNCH = """<launch>
  <node name="manager" pkg="nodelet" type="nodelet" args="manager" required="true" output="screen"/>
  <node name="debayer" pkg="nodelet" type="nodelet" args="load image_proc/debayer manager" output="screen"/>
</launch>
"""
# A mosaic of one colour has that colour everywhere.
COLLECT = """import rospy
from sensor_msgs.msg import Image
rospy.init_node("collect")
row, next_row = bytes([200, 100] * 4), bytes([100, 50] * 4)
mosaic = Image(height=8, width=8, step=8, encoding="bayer_rggb8", data=(row + next_row) * 4)
camera = rospy.Publisher("image_raw", Image, queue_size=1)
rospy.Timer(rospy.Duration(0.1), lambda _: camera.publish(mosaic))
seen = rospy.wait_for_message("image_color", Image, timeout=60)
print(seen.encoding, seen.width, seen.height, set(zip(seen.data[::3], seen.data[1::3], seen.data[2::3])))
"""


@pytest.mark.parametrize("path", [None, f"{EXAMPLES}:{SHARED_PACKAGES}"], ids=["fresh", "sourced"])
def test_a_nodelet_is_loaded_into_a_genuine_manager(plain_ros: RosSystem, path: str | None) -> None:
    side = plain_ros.pipros
    side.environment.pop("ROS_PACKAGE_PATH")
    if path is not None:
        side.environment["ROS_PACKAGE_PATH"] = path
    (plain_ros.home / "debayer.launch").write_text(LAUNCH)
    (plain_ros.home / "collect.py").write_text(COLLECT)
    side.environment["PIPROS_NODELETS"] = "genuine"
    launch = side.start("roslaunch", "-p", str(plain_ros.port), "debayer.launch")
    launch.wait_for(r"process\[debayer-\d+\]: started")

    collected = side.run("python3", "collect.py", timeout_s=120)

    assert collected.stdout == ["bgr8 8 8 {(50, 100, 200)}"], collected.output + launch.output


@pytest.mark.parametrize("path", ["", "/usr/share"])
@pytest.mark.parametrize(
    ("package", "program", "place"),
    [
        ("image_rotate", "image_rotate", "/usr/lib/image_rotate"),
        ("nodelet", "declared_nodelets", "/usr/lib/nodelet"),
        ("topic_tools", "throttle", f"{SHARED_PACKAGES}/topic_tools/scripts"),
        ("rosbag", "record", f"{SHARED_PACKAGES}/rosbag/"),
    ],
)
def test_rosrun_finds_programs_of_debian_and_of_pipros(plain_ros, package, program, place, path: str) -> None:
    plain_ros.pipros.environment["ROS_PACKAGE_PATH"] = path
    found = plain_ros.pipros.run("rosrun", "--prefix", "/bin/echo", package, program)
    assert found.stdout[0].startswith(place), found.output


def test_queries_of_packages_keep_the_winner(plain_ros: RosSystem) -> None:
    plain_ros.pipros.environment["ROS_PACKAGE_PATH"] = "/usr/share"
    for package, folder in (("nodelet", f"{SHARED_PACKAGES}/nodelet"), ("pluginlib", "/usr/share/pluginlib")):
        assert plain_ros.pipros.run("rospack", "find", package).stdout == [folder]
