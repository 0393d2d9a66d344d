"""Nodelets of images beside Debian's genuine ones, with the same inputs."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodelets.hosting import Hosting
from pipros_robot.perception.images.arrays import array_of
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.pictures_of_cameras import camera_info, depths, image, picture, right_info, stereo_pair
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

IMAGE, INFO, CLOUD = "sensor_msgs/Image", "sensor_msgs/CameraInfo", "sensor_msgs/PointCloud2"
DISPARITY = "stereo_msgs/DisparityImage"
Roi: Any = load_message_class("sensor_msgs/RegionOfInterest")

SIDES = ("pipros", "genuine")


class Pair:
    """A nodelet of pipros in this process, and the genuine one, with the same inputs."""

    def __init__(self, ros: RosSystem, node: Node, host: Hosting) -> None:
        self._ros, self._node, self._host = ros, node, host
        self._inputs: dict[str, Any] = {}
        self._inboxes: dict[tuple[str, str], Inbox] = {}

    def start(
        self, plugin: str, inputs: Mapping[str, str], outputs: Mapping[str, str], **parameters: Any
    ) -> None:
        """Start both. `inputs` and `outputs` are types by topic."""
        for side in SIDES:
            remappings = {f"/{side}/{name}": f"/{name}" for name in inputs}
            for name, value in parameters.items():
                self._node.params.set(f"/{side}/n/{name}", value)
            for name, kind in outputs.items():
                inbox = self._inboxes[side, name] = Inbox()
                self._node.subscribe(f"/{side}/{name}", load_message_class(kind), inbox)
            if side == "pipros":
                self._host.load(f"/{side}/n", plugin, remappings=remappings)
            else:
                arguments = ["__name:=n", f"__ns:=/{side}", *(f"{a}:={b}" for a, b in remappings.items())]
                self._ros.genuine.start("/usr/lib/nodelet/nodelet", "standalone", plugin, *arguments)
        for name, kind in inputs.items():
            self._inputs[name] = self._node.advertise(f"/{name}", load_message_class(kind))

    def send(self, *messages: Any) -> None:
        """Publish a message on each input, in their order."""
        for publisher, message in zip(self._inputs.values(), messages, strict=True):
            wait_until_connected(publisher, 2)
            publisher.publish(message)

    def received(self, name: str, count: int) -> tuple[Any, Any]:
        """Wait until an output has `count` messages on both sides, and return the last ones."""
        inboxes = [self._inboxes[side, name].messages for side in SIDES]
        wait_until(lambda: all(len(each) >= count for each in inboxes), 60, lambda: f"{[*map(len, inboxes)]}")
        ours, genuine = (each[count - 1] for each in inboxes)
        return ours, genuine

    def is_answered(self, stamp: Any, timeout_s: float) -> bool:
        """Return whether the last message of each output gets this stamp in time."""
        boxes = [inbox.messages for inbox in self._inboxes.values()]
        with suppress(AssertionError):
            wait_until(lambda: all(each and each[-1].header.stamp == stamp for each in boxes), timeout_s)
            return True
        return False

    def forget(self) -> None:
        """Forget the messages that were received."""
        for inbox in self._inboxes.values():
            inbox.messages.clear()


@pytest.fixture
def pair(ros: RosSystem) -> Iterator[Pair]:
    ros.serve_master()
    environment = Environment(master_uri=ros.master_uri)
    with Node("test", environment=environment) as node, Node("host", environment=environment) as host:
        yield Pair(ros, node, Hosting(host))


def assert_same_image(ours: Any, genuine: Any, tolerance: float = 0.0) -> None:
    for name in ("height", "width", "encoding", "step", "is_bigendian"):
        assert getattr(ours, name) == getattr(genuine, name)
    assert (ours.header.frame_id, ours.header.stamp) == (genuine.header.frame_id, genuine.header.stamp)
    one, two = (array_of(each).astype(float) for each in (ours, genuine))
    assert (np.isnan(one) == np.isnan(two)).all()
    assert np.nanmax(np.abs(one - two), initial=0) <= tolerance


def assert_same_cloud(ours: Any, genuine: Any, tolerance: float) -> None:
    for name in ("height", "width", "point_step", "row_step", "is_bigendian", "is_dense"):
        assert getattr(ours, name) == getattr(genuine, name)
    assert str(ours.fields) == str(genuine.fields)
    assert (ours.header.frame_id, ours.header.stamp) == (genuine.header.frame_id, genuine.header.stamp)
    one, two = (
        np.frombuffer(each.data, np.float32).reshape(-1, each.point_step // 4) for each in (ours, genuine)
    )
    assert (np.isnan(one[:, :3]) == np.isnan(two[:, :3])).all()
    assert np.nanmax(np.abs(one[:, :3] - two[:, :3])) <= tolerance
    assert one[:, 3:].tobytes() == two[:, 3:].tobytes()


def test_images_are_rectified_as_by_image_proc(pair: Pair) -> None:
    pair.start("image_proc/rectify", {"image_mono": IMAGE, "camera_info": INFO}, {"image_rect": IMAGE})
    roi = {"roi": Roi(x_offset=100, y_offset=60, width=300, height=200)}
    rational = {
        "D": [0.1, -0.05, 0.001, 0.002, 0.03, 0.02, 0.01, 0.003],
        "distortion_model": "rational_polynomial",
    }
    cases: list[tuple[str, Any, dict[str, Any]]] = [
        ("bgr8", picture(), {}), ("mono16", picture(1, dtype=np.uint16), {}),
        ("32FC1", picture(1, dtype=np.float32), {}), ("mono8", picture(1), rational),
        ("mono8", picture(1), {"D": [0.1, -0.02, 0.003, 0.002], "distortion_model": "equidistant"}),
        ("mono8", picture(1, (240, 320)), {"binning_x": 2, "binning_y": 2}), ("mono8", picture(1), {"D": []}),
        ("mono8", picture(1, (200, 300)), roi),
        ("mono8", picture(1, (100, 150), detail=2), {**roi, "binning_x": 2, "binning_y": 2}),
    ]  # fmt: skip
    for number, (encoding, pixels, fields) in enumerate(cases, 1):
        pair.send(image(pixels, encoding, number), camera_info(number, **fields))
        assert_same_image(*pair.received("image_rect", number), tolerance=1)


@pytest.mark.parametrize("interpolation", [0, 2, 3, 4])
def test_other_interpolations_are_those_of_image_proc(pair: Pair, interpolation: int) -> None:
    inputs = {"image_mono": IMAGE, "camera_info": INFO}
    pair.start("image_proc/rectify", inputs, {"image_rect": IMAGE}, interpolation=interpolation)
    pair.send(image(picture(), "bgr8", 1), camera_info(1))
    assert_same_image(*pair.received("image_rect", 1), tolerance=1)


def test_raw_images_are_converted_as_by_image_proc(pair: Pair) -> None:
    pair.start("image_proc/debayer", {"image_raw": IMAGE}, {"image_mono": IMAGE, "image_color": IMAGE})
    channels = {"rgb8": 3, "bgra8": 4, "bgr16": 3, "mono8": 1, "mono16": 1, "yuv422": 2}
    bayer = [f"bayer_{order}{bits}" for order in ("rggb", "bggr", "gbrg", "grbg") for bits in (8, 16)]
    for number, encoding in enumerate([*bayer, *channels], 1):
        dtype = np.uint16 if encoding.endswith("16") else np.uint8
        pair.send(image(picture(channels.get(encoding, 1), dtype=dtype), encoding, number))
        for output in ("image_mono", "image_color"):
            assert_same_image(*pair.received(output, number), tolerance=1)


def test_depths_become_points_as_by_depth_image_proc(pair: Pair) -> None:
    pair.start(
        "depth_image_proc/point_cloud_xyz", {"image_rect": IMAGE, "camera_info": INFO}, {"points": CLOUD}
    )
    for number, encoding in enumerate(("16UC1", "32FC1", "mono16"), 1):
        pair.send(image(depths(encoding), encoding, number), camera_info(number))
        assert_same_cloud(*pair.received("points", number), tolerance=1e-6)
    pair.send(image(depths("16UC1", (240, 320)), "16UC1", 4), camera_info(4, binning_x=2, binning_y=2))
    assert_same_cloud(*pair.received("points", 4), tolerance=1e-6)


def test_depths_and_colors_become_points_as_by_depth_image_proc(pair: Pair) -> None:
    inputs = {"depth_registered/image_rect": IMAGE, "rgb/image_rect_color": IMAGE, "rgb/camera_info": INFO}
    pair.start("depth_image_proc/point_cloud_xyzrgb", inputs, {"depth_registered/points": CLOUD})
    cases: list[tuple[str, str, Any]] = [
        ("16UC1", "rgb8", picture()), ("32FC1", "bgra8", picture(4)), ("16UC1", "mono8", picture(1)),
        ("32FC1", "rgb16", picture(3, dtype=np.uint16)), ("16UC1", "rgb8", picture(3, (240, 320))),
        ("32FC1", "bgr8", picture(3, (1024, 1280))),
    ]  # fmt: skip
    for number, (encoding, colors, pixels) in enumerate(cases, 1):
        info = camera_info(number, size=pixels.shape[:2])
        pair.send(image(depths(encoding), encoding, number), image(pixels, colors, number), info)
        assert_same_cloud(*pair.received("depth_registered/points", number), tolerance=1e-6)


def test_depths_change_their_unit_as_by_depth_image_proc(pair: Pair) -> None:
    pair.start("depth_image_proc/convert_metric", {"image_raw": IMAGE}, {"image": IMAGE})
    for number, encoding in enumerate(("16UC1", "32FC1"), 1):
        pair.send(image(depths(encoding), encoding, number))
        assert_same_image(*pair.received("image", number))


@pytest.mark.parametrize("fills_holes", [False, True])
def test_depths_are_registered_as_by_depth_image_proc(pair: Pair, fills_holes: bool) -> None:
    transform: Any = load_message_class("geometry_msgs/TransformStamped")(child_frame_id="camera")
    transform.header.frame_id = "rgb"
    at, turn = transform.transform.translation, transform.transform.rotation
    at.x, at.y, at.z = -0.025, 0.003, 0.01
    turn.x, turn.y, turn.z, turn.w = np.array([0.004, -0.01, 0.006, 1]) / np.linalg.norm(
        [0.004, 0.01, 0.006, 1]
    )
    kind: Any = load_message_class("tf2_msgs/TFMessage")
    static = pair._node.advertise("/tf_static", kind, latch=True)
    static.publish(kind([transform]))
    inputs = {"depth/image_rect": IMAGE, "depth/camera_info": INFO, "rgb/camera_info": INFO}
    outputs = {"depth_registered/image_rect": IMAGE, "depth_registered/camera_info": INFO}
    pair.start("depth_image_proc/register", inputs, outputs, fill_upsampling_holes=fills_holes)
    wait_until_connected(static, 2)
    for number in range(1, 30):  # genuine tf drops images until it has read the transform
        pair.send(
            image(depths("16UC1"), "16UC1", number), camera_info(number), camera_info(number, frame="rgb")
        )
        if pair.is_answered(camera_info(number).header.stamp, 2):
            break
    pair.forget()
    for number, (encoding, size) in enumerate((("16UC1", (480, 640)), ("32FC1", (960, 1280))), 1):
        time_s = 100 + number
        depth, rgb = camera_info(time_s), camera_info(time_s, size=size, frame="rgb")
        pair.send(image(depths(encoding), encoding, time_s), depth, rgb)
        assert_same_image(*pair.received("depth_registered/image_rect", number))
        ours, genuine = pair.received("depth_registered/camera_info", number)
        ours.header.seq = genuine.header.seq
        assert str(ours) == str(genuine)


BM, SGBM = {"speckle_range": 2}, {"stereo_algorithm": 1, "correlation_window_size": 8, "disp12MaxDiff": 2}


@pytest.mark.parametrize(
    "settings", [BM, SGBM, {**SGBM, "fullDP": True, "min_disparity": -16}, {"downsampling_factor": 2}]
)
def test_disparities_are_those_of_stereo_image_proc(pair: Pair, settings: dict[str, Any]) -> None:
    inputs = {
        "left/image_rect": IMAGE, "left/camera_info": INFO, "right/image_rect": IMAGE,
        "right/camera_info": INFO,
    }  # fmt: skip
    pair.start("stereo_image_proc/disparity", inputs, {"disparity": DISPARITY}, **settings)
    left, right = stereo_pair()
    pair.send(image(left, "mono8", 1), camera_info(1), image(right, "mono8", 1), right_info(1))
    ours, genuine = pair.received("disparity", 1)
    one, two = array_of(ours.image), array_of(genuine.image)
    assert (np.abs(one - two) <= 1 / 16).mean() >= 0.99
    assert (two >= 0).mean() > 0.5
    for name in ("f", "T", "min_disparity", "max_disparity", "delta_d"):
        assert getattr(ours, name) == getattr(genuine, name)
    assert (ours.header.stamp, ours.image.encoding) == (genuine.header.stamp, genuine.image.encoding)


def test_disparities_become_points_as_by_stereo_image_proc(pair: Pair) -> None:
    inputs = {
        "left/image_rect_color": IMAGE, "left/camera_info": INFO, "right/camera_info": INFO,
        "disparity": DISPARITY,
    }  # fmt: skip
    pair.start("stereo_image_proc/point_cloud2", inputs, {"points2": CLOUD})
    disparities = np.round((20 + 19 * np.sin(np.mgrid[0:480, 0:640][1] / 60)) * 16) / 16
    disparities[np.random.default_rng(3).random(disparities.shape) < 0.1] = -1
    for number, encoding in enumerate(("bgr8", "rgba8", "mono8", "mono16"), 1):
        channels = {"mono8": 1, "mono16": 1, "rgba8": 4}.get(encoding, 3)
        pixels = picture(channels, dtype=np.uint16 if encoding == "mono16" else np.uint8)
        message: Any = load_message_class(DISPARITY)(f=500.2, T=0.12, max_disparity=63.0)
        message.image = image(disparities.astype(np.float32), "32FC1", number)
        message.header = message.image.header
        pair.send(image(pixels, encoding, number), camera_info(number), right_info(number), message)
        ours, genuine = pair.received("points2", number)
        assert_same_cloud(ours, genuine, tolerance=1e-4)  # at depths of up to 60 m, single precision


@pytest.mark.parametrize("program", ["image_proc", "stereo_image_proc"])
def test_the_programs_have_the_names_of_the_genuine_ones(ros: RosSystem, program: str) -> None:
    ros.serve_master()
    ros.pipros.start("rosrun", program, program, "__ns:=/a")
    ros.genuine.start(f"/usr/lib/{program}/{program}", "__ns:=/b")
    found: dict[str, set[str]] = {"a": set(), "b": set()}
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:

        def names() -> bool:
            published, _, services = node.master.get_system_state()
            for space in found:
                entries = [each[0] for each in (*published, *services)]
                found[space] = {name[2:] for name in entries if name.startswith(f"/{space}/")}
                found[space] |= {
                    key[2:] for key in node.master.get_param_names() if key.startswith(f"/{space}/")
                }
            ours = {name for name in found["a"] if "/compressed" not in name}
            return len(found["b"]) > 10 and ours == found["b"]

        wait_until(names, 60, lambda: f"{sorted(found['a'] ^ found['b'])}")
