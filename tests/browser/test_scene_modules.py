"""The scene's calculations in the browser agree with those of the library and with the tables of rviz."""

from __future__ import annotations

import random
import struct
import zlib
from typing import Any

import pytest
from playwright.sync_api import Page as Tab

from pipros.libraries.transforms.buffer import TransformBuffer
from pipros.libraries.transforms.errors import TransformException
from pipros.libraries.transforms.pose import Pose
from pipros.msg import load_message_class
from pipros.web.message_layout import message_layout
from pipros.web.rviz_file import read_rviz
from tests.browser.conftest import OpenTab
from tests.support.environments import REPOSITORY
from tests.support.page import Page
from tests.support.ros import RosSystem

LOOKUPS = 10_000
SECOND = 1_000_000_000


@pytest.fixture
def tab(ros: RosSystem, open_tab: OpenTab) -> Tab:
    ros.pipros.start_master()
    return open_tab(Page(ros, command="rviz"), "topics")


def random_pose(chance: random.Random) -> Pose:
    quaternion = [chance.gauss(0, 1) for _ in range(4)]
    norm = sum(value * value for value in quaternion) ** 0.5
    x, y, z, w = (value / norm for value in quaternion)
    return (chance.uniform(-9, 9), chance.uniform(-9, 9), chance.uniform(-9, 9), x, y, z, w)


def test_transforms_are_looked_up_as_in_the_library(tab: Tab) -> None:
    chance = random.Random(27)  # noqa: S311 # reproducible, no secret
    names = [f"f{number}" for number in range(14)]
    buffer = TransformBuffer()
    inserts: list[Any] = []
    for _ in range(1200):
        child = chance.randrange(1, 12)
        parent = names[chance.randrange(child)] if chance.random() < 0.05 else names[child // 2]
        stamp = 100 * SECOND + chance.randrange(13 * SECOND)
        arguments = (parent, names[child], stamp, random_pose(chance))
        buffer.insert(*arguments, "test", is_static=child % 5 == 0)
        inserts.append([parent, names[child], str(stamp), list(arguments[3]), child % 5 == 0])
    buffer.insert(names[12], names[13], 110 * SECOND, random_pose(chance), "test")
    questions, answers = [], []
    last = buffer.lookup(names[12], names[13], 0)
    inserts.append([names[12], names[13], str(110 * SECOND), list(last[1]), False])
    for _ in range(LOOKUPS):
        target, source = (chance.choice([*names, "missing"]) for _ in range(2))
        time = chance.choice([0, 99, *range(103, 114)]) * SECOND
        time += chance.randrange(SECOND) if time else 0
        questions.append([target, source, str(time)])
        try:
            answers.append(list(buffer.lookup(target, source, time)[1]))
        except TransformException as error:
            answers.append([type(error).__name__, str(error).split("\n")[0]])
    found = tab.evaluate(
        """async ([inserts, questions]) => {
          const { Frames } = await import("/scene/frames.js");
          const frames = new Frames();
          for (const [parent, child, stamp, pose, isStatic] of inserts) {
            frames.insert(parent, child, BigInt(stamp), pose, "test", isStatic);
          }
          return questions.map(([target, source, time]) => {
            try { return [...frames.lookup(target, source, BigInt(time))]; }
            catch (error) { return [error.kind, error.message]; }
          });
        }""",
        [inserts, questions],
    )
    errors = 0
    for question, expected, actual in zip(questions, answers, found, strict=True):
        if len(expected) == 2:
            errors += 1
            assert actual == expected, question
        else:
            assert actual == pytest.approx(expected, abs=1e-9), question
    assert 0.1 < errors / LOOKUPS < 0.9


def test_messages_are_decoded_as_by_the_library(tab: Tab) -> None:
    marker_class = load_message_class("visualization_msgs/Marker")
    marker: Any = marker_class()
    marker.header.frame_id, marker.header.stamp.secs, marker.header.stamp.nsecs = "zäh", 4_000_000_000, 7
    marker.points = [load_message_class("geometry_msgs/Point")(1.5, -2.0, 3.0)]
    marker.id, marker.frame_locked, marker.lifetime.secs = -5, True, -1
    body = b"".join(_buffers(marker))
    found = tab.evaluate(
        """async ([types, bytes]) => {
          const { decoderOf } = await import("/scene/layout.js");
          const decode = decoderOf(types, "visualization_msgs/Marker");
          const array = Uint8Array.from(bytes);
          const message = decode(new DataView(array.buffer));
          const cut = [];
          for (let size = 0; size < array.length; size += 1) {
            try { decode(new DataView(array.buffer, 0, size)); cut.push(size); } catch { }
          }
          return [message.header.frame_id, String(message.header.stamp), message.id, message.frame_locked,
            String(message.lifetime), message.points, cut];
        }""",
        [message_layout("visualization_msgs/Marker", marker_class._full_text), list(body)],
    )
    point = {"x": 1.5, "y": -2.0, "z": 3.0}
    assert found == ["zäh", "4000000000000000007", -5, True, "-1000000000", [point], []]


def test_counts_beyond_the_message_are_refused(tab: Tab) -> None:
    path_class = load_message_class("nav_msgs/Path")
    body = b"".join(_buffers(path_class()))[:-4] + struct.pack("<I", 0xFFFFFFFF)
    found = tab.evaluate(
        """async ([types, bytes]) => {
          const { decoderOf } = await import("/scene/layout.js");
          try { decoderOf(types, "nav_msgs/Path")(new DataView(Uint8Array.from(bytes).buffer)); return ""; }
          catch (error) { return error.message; }
        }""",
        [message_layout("nav_msgs/Path", path_class._full_text), list(body)],
    )
    assert found == "an array of 4294967295 elements does not fit into the message"


def test_selected_lines_and_boxes_have_the_box_of_their_points(tab: Tab) -> None:
    found = tab.evaluate(
        """async () => {
          const { wideLines } = await import("/scene/shapes.js");
          const { points } = await import("/scene/points.js");
          const THREE = await import("three");
          const places = [1, 2, 3, -4, 5, 6];
          const lines = wideLines(places, 0.1, [1, 0, 0, 1]);
          const boxes = points("Boxes", Float32Array.from(places), new Uint8Array(8), [2, 4, 6]);
          return [lines, boxes].map((each) => {
            const { min, max } = new THREE.Box3().setFromObject(each);
            return [...min.toArray(), ...max.toArray()];
          });
        }"""
    )
    assert found == [[-4, 2, 3, 1, 5, 6], [-5, 0, 0, 2, 7, 9]]


def test_compressed_batches_are_unpacked(tab: Tab) -> None:
    batches = [b"\1" + zlib.compress(b"body" * 100, 1), b"\0" + b"body" * 100]
    found = tab.evaluate(
        """async (batches) => {
          const { unpacked } = await import("/scene/batches.js");
          const texts = [];
          for (const batch of batches) {
            const view = await unpacked(new DataView(Uint8Array.from(batch).buffer));
            texts.push(new TextDecoder().decode(view));
          }
          return texts;
        }""",
        [list(batch) for batch in batches],
    )
    assert found == ["body" * 100] * 2


def test_colours_are_those_of_rviz(tab: Tab) -> None:
    found = tab.evaluate(
        """async () => {
          const { rainbow, mapPalette, parsedColour } = await import("/scene/colours.js");
          const of = (fraction) => { const out = []; rainbow(fraction, out, 0); return out; };
          const cell = (scheme, value) => [...mapPalette(scheme).slice(value * 4, value * 4 + 4)];
          return {
            rainbow: [0, 0.2, 0.4, 0.6, 0.8, 1].map(of),
            map: [0, 50, 100, 101, 128, 254, 255].map((value) => cell("map", value).slice(0, 3)),
            costmap: [0, 1, 50, 98, 99, 100, 254].map((value) => cell("costmap", value)),
            parsed: ["160; 160; 164", "#ff8000", "nonsense"].map((text) => parsedColour(text)),
          };
        }"""
    )
    assert found["rainbow"] == [
        [255, 0, 0],
        [255, 255, 0],
        [0, 255, 0],
        [0, 255, 255],
        [0, 0, 255],
        [255, 0, 255],
    ]
    greys = [[255] * 3, [128] * 3, [0] * 3]
    assert found["map"] == [*greys, [0, 255, 0], [255, 0, 0], [255, 255, 0], [112, 137, 134]]
    assert found["costmap"] == [
        [0, 0, 0, 0],
        [2, 0, 253, 255],
        [127, 0, 128, 255],
        [249, 0, 6, 255],
        [0, 255, 255, 255],
        [255, 0, 255, 255],
        [255, 255, 0, 255],
    ]
    assert found["parsed"] == [[160, 160, 164], [255, 128, 0], [255, 255, 255]]


def test_changed_properties_leave_the_others_alone(tab: Tab) -> None:
    found = tab.evaluate(
        """async () => {
          const { Properties } = await import("/scene/properties.js");
          const { DISPLAYS } = await import("/scene/schema.js");
          const topic = { Value: "/a", Depth: "5" };
          const config = { Later: "007", Topic: topic, Shape: "Axes", Alpha: "0.0299999993" };
          const properties = new Properties(DISPLAYS["rviz/Odometry"], config);
          const before = [properties.get("Topic"), properties.get("Shape"), properties.get("Keep"),
            properties.get("Covariance", "Position", "Color")];
          properties.set(["Shape", "Color"], [1, 2, 3]);
          properties.set(["Covariance", "Position"], false);
          properties.set(["Topic"], "/b");
          return [before, config, properties.get("Covariance", "Position")];
        }"""
    )
    assert found == [
        ["/a", "Axes", 100, [204, 51, 204]],
        {
            "Later": "007",
            "Topic": {"Value": "/b", "Depth": "5"},
            "Shape": {"Value": "Axes", "Color": "1; 2; 3"},
            "Alpha": "0.0299999993",
            "Covariance": {"Position": {"Value": "false"}},
        },
        False,
    ]


def test_defaults_are_those_of_rviz(tab: Tab) -> None:
    config = read_rviz((REPOSITORY / "tests" / "golden" / "rviz_defaults.rviz").read_bytes())
    found = tab.evaluate(
        """async ({ Displays, Views }) => {
          const { Properties, childrenOf } = await import("/scene/properties.js");
          const { DISPLAYS, VIEWS } = await import("/scene/schema.js");
          const wrong = [];
          const isClose = (one, other) => one === other || Math.abs(one - other) < 1e-6
            || (Array.isArray(one) && one.every((part, i) => isClose(part, other[i])));
          const check = (own, schema, properties, fallbacks, path) => {
            for (const definition of schema) {
              const [name, kind] = definition;
              const here = [...path, name];
              if (kind !== "group" && kind !== "names") {
                const [value, fallback] = [properties, fallbacks].map((each) => each.get(...here));
                if (!isClose(value, fallback)) wrong.push(`${own}: ${here}: ${value}, not ${fallback}`);
              }
              const inner = childrenOf(definition);
              if (inner) check(own, inner, properties, fallbacks, here);
            }
          };
          for (const [table, list] of [[DISPLAYS, Displays], [VIEWS, Views.Saved]]) for (const each of list) {
            const schema = table[each.Class];
            check(each.Class, schema, new Properties(schema, each), new Properties(schema, {}), []);
          }
          return wrong;
        }""",
        config["Visualization Manager"],
    )
    assert found == []


def test_a_silent_server_of_markers_is_reported_until_it_returns(tab: Tab) -> None:
    found = tab.evaluate(
        """async () => {
          const { InteractiveClient } = await import("/scene/interactive_client.js");
          const said = [];
          const client = new InteractiveClient({ clear() {}, say: (...words) => said.push(words) });
          client.initialize({ server_id: "a", seq_num: 1, markers: [] }, 0);
          for (const now of [1000, 5000]) client.check(now);
          client.update({ server_id: "a", seq_num: 1, type: 0 }, 6000);
          client.check(7000);
          return said;
        }"""
    )
    receiving = ["ok", "Receiving updates.", "a"]
    assert found == [receiving, ["warning", "No update received for 5 seconds.", "a"], receiving]


def _buffers(message: Any) -> list[bytes]:
    from io import BytesIO

    buffer = BytesIO()
    message.serialize(buffer)
    return [buffer.getvalue()]
