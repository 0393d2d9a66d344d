"""The data of the tabs: numbers for curves, pixels, frames, components."""

import json
import math
import struct
from types import SimpleNamespace
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from rosgraph_msgs.msg import Log as LogMessage
from sensor_msgs.msg import BatteryState, CompressedImage, Image, Imu, JointState, LaserScan
from std_msgs.msg import Bool, Float64, Header, String
from tf2_msgs.msg import TFMessage

from genpy import Time
from pipros_page.bounded_list import PAGE_VIEW_BYTES, bounded_list
from pipros_page.curve_samples import NotANumber, find_field, number_in, numeric_fields
from pipros_page.images.pixels import LARGEST_BYTES, packed
from pipros_page.new_samples import NewSamples
from pipros_page.views import console
from pipros_page.views.diagnostics import Statuses
from pipros_page.views.frames import FrameTree, pose_values
from pipros_page.views.topics import percentage, plain_values
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.drawing.layered_layout import Box

TOPICS = {"/imu": "sensor_msgs/Imu", "/imu/raw": "sensor_msgs/Imu", "/joints": "sensor_msgs/JointState"}


@pytest.mark.parametrize(("text", "topic", "path"), [
    ("/imu/angular_velocity/x", "/imu", ["angular_velocity", "x"]),
    ("/imu/raw/angular_velocity/x", "/imu/raw", ["angular_velocity", "x"]),
    ("/joints/position[2]", "/joints", ["position[2]"]), ("/imu", "/imu", []),
])  # fmt: skip
def test_a_field_belongs_to_the_longest_topic(text: str, topic: str, path: list[str]) -> None:
    field = find_field(text, TOPICS)
    assert (field.topic, [step.text for step in field.path]) == (topic, path)


def test_a_field_of_no_topic_is_not_found() -> None:
    assert find_field("/im", TOPICS) is None


@pytest.mark.parametrize(("text", "message", "number"), [
    ("/imu/angular_velocity/x", Imu(), 0.0), ("/joints/position[1]", JointState(position=[1.0, 2.5]), 2.5),
    ("/imu/header/stamp", Imu(header=Header(stamp=Time(3, 500_000_000))), 3.5), ("/imu", Float64(7.5), 7.5),
    ("/imu", Bool(True), 1.0), ("/imu", String("%25"), 25.0), ("/imu", Float64(math.nan), None),
])  # fmt: skip
def test_numbers_of_messages(text: str, message: Any, number: float | None) -> None:
    field = find_field(text, TOPICS)
    assert field is not None
    assert number_in(message, field) == number


def test_fields_that_are_not_numbers_are_named() -> None:
    field = find_field("/imu/header", TOPICS)
    assert field is not None
    with pytest.raises(NotANumber, match=r"/imu/header must be a number, got ") as caught:
        number_in(Imu(), field)
    assert caught.value.fields == ["seq", "stamp"]


@pytest.mark.parametrize("path", ["orientation_covariance[9]", "orientation/x[0]"])
def test_an_element_that_the_message_lacks_is_named(path: str) -> None:
    field = find_field(f"/imu/{path}", TOPICS)
    assert field is not None
    with pytest.raises(ValueError, match=r"the message has no element /imu/orientation"):
        number_in(Imu(), field)


def test_samples_of_a_slow_browser_are_lost_and_counted() -> None:
    samples = NewSamples(3)
    for number in range(5):
        samples.add(number)
    samples.lose()
    assert (samples.pop_all(), samples.pop_all()) == (([2, 3, 4], 3), ([], 0))


def test_pixels_come_without_padding() -> None:
    head, pixels = packed(Image(width=2, height=2, step=8, encoding="rgb8", data=b"abcdef--ghijkl--"))
    assert pixels == b"abcdefghijkl"
    assert (head["width"], head["height"], head["encoding"]) == (2, 2, "rgb8")


@pytest.mark.parametrize(("encoding", "size"), [("mono8", 1), ("rgb8", 3), ("32FC1", 4)])
def test_large_images_are_thinned_out(encoding: str, size: int) -> None:
    side = math.isqrt(LARGEST_BYTES // size) * 2
    image = Image(
        width=side, height=side, step=side * size, encoding=encoding, data=bytes(side * side * size)
    )
    head, pixels = packed(image)
    assert len(pixels) == head["width"] * head["height"] * size <= LARGEST_BYTES
    assert head["full"] == [side, side]


def test_compressed_images_are_left_to_the_browser() -> None:
    assert packed(CompressedImage(format="bgr8; png compressed", data=b"x"))[0]["compressed"] == "png"
    assert packed(CompressedImage(format="jpeg", data=b"x")) == (
        {"compressed": "jpeg", "format": "jpeg"},
        b"x",
    )


@pytest.mark.parametrize(("height", "step"), [(0, 0), (4_000_000_000, 0), (0, 6)])
def test_an_image_without_pixels_is_shown_as_such(height: int, step: int) -> None:
    head, pixels = packed(Image(width=0, height=height, step=step, encoding="rgb8", data=b""))

    assert (head["full"], pixels) == ([0, height], b"")


@pytest.mark.parametrize(("message", "words"), [
    (Image(width=2, height=2, step=1, encoding="mono8", data=b"1234"), "in rows of 1"),
    (Image(width=2, height=9, step=2, encoding="mono8", data=b"1234"), "need 9 rows of 2 bytes, got 4"),
    (Image(width=1, height=1, step=1, encoding="<b>", data=b"1"), "encoding \\[<b>\\]"),
    (Image(width=1, height=1, step=12, encoding="32FC3", data=b"1" * 12), "encoding \\[32FC3\\]"),
    (CompressedImage(format="16UC1; compressedDepth", data=b"0" * 11), "must be 16UC1"),
    (CompressedImage(format="8UC1; compressedDepth", data=b"0" * 20), "got \\[8UC1\\]"),
    (CompressedImage(format="16UC1; compressedDepth rvl", data=b"0" * 20), "not RVL"),
])  # fmt: skip
def test_images_that_cannot_be_shown_are_refused(message: Any, words: str) -> None:
    with pytest.raises(RequestRefused, match=words):
        packed(message)


@pytest.mark.parametrize(("is_big", "data"), [(0, b"1a2b3c"), (1, b"a1b2c3")])
def test_colours_of_16_bits_are_shown_with_their_more_significant_bytes(is_big: int, data: bytes) -> None:
    image = Image(width=1, height=1, step=6, encoding="rgb16", is_bigendian=is_big, data=data)
    head, pixels = packed(image)
    assert (head["depth"], pixels) == ("8U", b"abc")


def test_a_compressed_depth_image_has_its_quantisation() -> None:
    png = b"\x89PNG\r\n\x1a\n..."
    data = struct.pack("<iff", 0, 2.5, 0.5) + png
    head = {"compressed": "depth", "encoding": "32FC1", "quantised": [2.5, 0.5]}
    assert packed(CompressedImage(format="32FC1; compressedDepth png", data=data)) == (head, png)


def transform(parent: str, child: str, stamp_s: int = 0) -> TransformStamped:
    return TransformStamped(header=Header(frame_id=parent, stamp=Time(stamp_s)), child_frame_id=child)


def test_a_pair_of_frames_has_its_pose_or_the_chains_that_do_not_meet() -> None:
    tree = FrameTree()
    link = transform("base", "hand", 10)
    link.transform.translation.x, link.transform.rotation.w = 0.5, 1.0
    tree.add(TFMessage([link]), 10.0, "/arm", is_static=False)
    found = pose_values(tree, "base", "hand", 12.0)
    assert (found["translation"], found["angles"], found["stamp"]) == ([0.5, 0, 0], [0, 0, 0], 10.0)
    assert found["source"] == [
        {"frame": "hand", "parent": "base", "from": "/arm", "age": 2.0, "stale": False}
    ]
    assert "error" in pose_values(tree, "moon", "hand", 12.0)
    tree.set_clock(11.0)
    tree.set_clock(1.0)
    assert "error" in pose_values(tree, "base", "hand", 12.0)


def test_chains_of_a_loop_end() -> None:
    tree = FrameTree()
    tree.add(TFMessage([transform("a", "b"), transform("b", "a")]), 1.0, "/x", is_static=True)
    assert [link["frame"] for link in tree.ancestors("a", 1.0)] == ["a", "b"]


def test_frames_have_parents_rates_and_ages() -> None:
    tree = FrameTree()
    for wall_s in (10.0, 10.1, 10.2):
        tree.add(TFMessage([transform("map", "/base", 10)]), wall_s, "/slam", is_static=False)
    tree.add(TFMessage([transform("base", "laser")]), 9.0, "/model", is_static=True)
    base, laser = tree.rows(11.2)
    assert (base["frame"], base["parent"], base["authority"], base["static"]) == (
        "base", "map", "/slam", False,
    )  # fmt: skip
    assert base["rate"] == pytest.approx(10.0)
    assert (base["age"], base["delay"]) == (1.0, 0.2)
    assert (laser["frame"], laser["static"], laser["rate"]) == ("laser", True, None)
    assert [(arrow.start.name, arrow.end.name) for arrow in tree.graph().arrows] == [
        ("map", "base"),
        ("base", "laser"),
    ]


def test_a_frame_without_new_transforms_is_stale_and_has_no_rate() -> None:
    tree = FrameTree()
    for wall_s in (10.0, 10.1, 10.2):
        tree.add(TFMessage([transform("map", "base", 10)]), wall_s, "/slam", is_static=False)
    tree.add(TFMessage([transform("base", "laser")]), 9.0, "/model", is_static=True)
    found = [(row["stale"], row["rate"] is None, row["delay"] is None) for row in tree.rows(13.3)]
    assert found == [(True, True, True), (False, True, True)]
    for number in range(60):  # the rate is that of the newest transforms
        tree.add(TFMessage([transform("map", "base", 20)]), 20.0 + number, "/slam", is_static=False)
    assert (tree.rows(80.0)[0]["stale"], tree.rows(80.0)[0]["rate"]) == (False, pytest.approx(1.0))
    tree.set_clock(90.0)
    assert not tree.rows(1000.0)[0]["stale"]


def test_a_frame_that_gets_another_parent_is_reset() -> None:
    tree = FrameTree()
    tree.add(TFMessage([transform("map", "base")]), 1.0, "/a", is_static=False)
    tree.add(TFMessage([transform("odom", "base")]), 2.0, "/a", is_static=False)
    assert [(row["parent"], row["rate"]) for row in tree.rows(2.0)] == [("odom", None)]


def test_a_tree_with_a_cycle_can_be_drawn() -> None:
    from pipros_tools.graph.drawing.scene import draw

    tree = FrameTree()
    tree.add(
        TFMessage([transform("a", "b"), transform("b", "a"), transform("c", "c")]), 1.0, "", is_static=False
    )
    boxes = [box for _, box, _ in draw(tree.graph()).boxes]
    assert len(boxes) == 3
    assert all(isinstance(box, Box) for box in boxes)


def test_components_have_levels_values_and_a_history() -> None:
    statuses = Statuses(1_000_000)
    for wall_s, level in ((1.0, 0), (2.0, 2)):
        status = DiagnosticStatus(level, "/Motors/left", "hot", "m1", [KeyValue("temperature", "90")])
        statuses.add(DiagnosticArray(status=[status]), None, wall_s)
    sent: dict[str, int] = {}
    (row,) = statuses.news(sent, 1_000_000)
    assert (row["name"], row["level"], row["values"]) == ("/Motors/left", 2, [["temperature", "90"]])
    assert (row["history"], row["last"]) == ([(1.0, 0), (2.0, 2)], 2.0)
    assert statuses.news(sent, 1_000_000) == []


def test_names_of_frames_are_cut() -> None:
    tree = FrameTree()
    tree.add(TFMessage([transform("p" * 20_000, "c" * 20_000)]), 1.0, "/a" * 10_000, is_static=False)
    (row,) = tree.rows(1.0)
    assert [len(row[key]) for key in ("frame", "parent", "authority")] == [300] * 3


def components(count: int, text: str, name: str = "/{}") -> DiagnosticArray:
    values = [KeyValue("k", text)] * 200
    return DiagnosticArray(
        status=[DiagnosticStatus(0, name.format(at), "", "", values) for at in range(count)]
    )


def test_unchanged_components_are_not_sent_again() -> None:
    statuses = Statuses(1_000_000)
    statuses.add(components(3, ""), None, 1.0)
    sent: dict[str, int] = {}
    assert len(statuses.news(sent, 1_000_000)) == 3
    statuses.add(DiagnosticArray(status=[DiagnosticStatus(1, "/1", "", "", [])]), None, 2.0)
    assert [(row["name"], row["level"]) for row in statuses.news(sent, 1_000_000)] == [("/1", 1)]


def test_many_components_are_sent_in_parts_and_all_are_sent() -> None:
    statuses = Statuses(10_000_000)
    sent: dict[str, int] = {}
    for moment in range(30):
        statuses.add(components(50, "x" * 100), None, float(moment))
        assert len(json.dumps(statuses.news(sent, 200_000))) < 400_000
    assert sent.keys() == {f"/{at}" for at in range(50)}


def test_diagnostics_stay_within_their_budget() -> None:
    statuses = Statuses(1_000_000)
    statuses.add(components(100, "x" * 50_000, name="/" + "n/" * 12_000 + "{}"), None, 1.0)
    statuses.add(components(100, "x" * 50_000), None, 1.0)
    rows = statuses.news({}, 10**9)
    assert len(json.dumps(rows)) < 1_500_000
    assert max(len(row["name"]) for row in rows) == 300
    assert any("the limit is 1000000 bytes" in row["values"][0][1] for row in rows)


def test_log_entries_stay_within_their_budget_and_dropped_ones_are_counted() -> None:
    log = console.Log(1_000_000)
    entry = LogMessage(name="n" * 16_000, msg="m" * 16_000, file="f" * 16_000, function="g" * 16_000)
    for _ in range(1000):
        log.add(entry, None, 1.0)
    entries, lost, number = log.since(0, 10**9)
    assert len(entries) + lost == number == 1000
    assert len(json.dumps(entries)) < 1_000_000
    assert [len(part) for part in entries[0] if isinstance(part, str)] == [300, 4000, 300, 300]
    assert log.since(number, 10**9) == ([], 0, 1000)


def test_log_entries_are_sent_in_parts_in_their_order() -> None:
    log = console.Log(1_000_000)
    for line in range(100):
        log.add(LogMessage(line=line, msg="m" * 1000), None, 1.0)
    lines: list[int] = []
    number = 0
    while number < log.end:
        entries, lost, number = log.since(number, 10_000)
        assert (len(entries) < 20, lost) == (True, 0)
        lines += [entry[5] for entry in entries]
    assert lines == list(range(100))


def test_the_numbers_of_a_message_are_offered_for_curves() -> None:
    scan = LaserScan(angle_min=-1.0, ranges=[1.0] * 50)

    fields = list(numeric_fields(scan))

    assert (fields[:3], fields[-1]) == (["header/seq", "header/stamp", "angle_min"], "ranges[9]")


def test_delays_are_in_simulated_time_once_there_is_one() -> None:
    tree = FrameTree()
    tree.set_clock(1015.5)

    tree.add(TFMessage([transform("map", "base", 1015.0)]), wall_s=1e9, authority="/sim", is_static=False)

    assert tree.rows(1e9)[0]["delay"] == 0.5


def test_a_message_is_copied_as_json_values() -> None:
    state = JointState(Header(1, Time(5, 6), "base"), ["a"], [1.5, float("nan")], [], [])

    assert plain_values(state) == {
        "header": {"seq": 1, "stamp": {"secs": 5, "nsecs": 6}, "frame_id": "base"}, "name": ["a"],
        "position": [1.5, None], "velocity": [], "effort": [],
    }  # fmt: skip


@pytest.mark.parametrize(("message", "percent"), [
    (String("%25"), 25.0), (String(" 80.5 %"), 80.5), (String("100%"), 100.0), (String("101%"), None),
    (String("25"), None), (String("%25%"), None), (BatteryState(percentage=0.5), 50.0),
    (BatteryState(percentage=float("nan")), None), (BatteryState(percentage=-1.0), None),
    (String("%7"), 7.0), (Header(), None), (SimpleNamespace(), None),
])  # fmt: skip
def test_a_percentage_is_found(message: object, percent: float | None) -> None:
    assert percentage(message) == percent


def test_lists_that_nodes_make_long_are_cut_for_browsers() -> None:
    most = PAGE_VIEW_BYTES
    assert bounded_list(["/a", "/b"]) == ["/a", "/b"]
    names = bounded_list((f"/{number}" + "x" * 1000 for number in range(100_000)), share=4)
    assert 0 < sum(map(len, names)) <= most // 4
