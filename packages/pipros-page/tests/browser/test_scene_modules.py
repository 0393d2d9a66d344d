"""The scene's calculations agree with the tables of rviz; `tests/page/unit` compares others with Python."""

import zlib

import pytest
from playwright.sync_api import Page as Tab

from pipros_page.scene.layout_file import read_rviz
from tests.browser.chromium import OpenTab
from tests.support.environments import file_of_tests
from tests.support.page import Page
from tests.support.ros import RosSystem


@pytest.fixture
def tab(ros: RosSystem, open_tab: OpenTab) -> Tab:
    ros.serve_master()
    return open_tab(Page(ros, command="rviz"), "topics")


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


TEXTS = ["İÅŞ", "Ễ\nxg", "ปู่ที่", "اَلْعَرَبِيَّة", "👩‍🚀", "Z̴̡̨͔̗͊̈́͝", "a\ng̱̱", "W" * 300, "\n".join("ab" * 50)]


def test_texts_are_drawn_whole(tab: Tab) -> None:
    found = tab.evaluate(
        """async (texts) => {
          const { textSprite } = await import("/scene/shapes.js");
          return texts.map((text) => {
            const { image } = textSprite(text, 1).material.map;
            const { data } = image.getContext("2d").getImageData(0, 0, image.width, image.height);
            const [right, bottom] = [image.width - 1, image.height - 1];
            const isInk = (x, y) => data[4 * (y * image.width + x) + 3] > 0;
            let [ink, cut] = [0, 0];
            for (let y = 0; y <= bottom; y++) for (let x = 0; x <= right; x++) {
              ink += isInk(x, y);
              cut += isInk(x, y) && (x === 0 || y === 0 || x === right || y === bottom);
            }
            return [ink > 50, cut];
          });
        }""",
        TEXTS,
    )
    assert found == [[True, 0]] * len(TEXTS)


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
        [255, 0, 0], [255, 255, 0], [0, 255, 0], [0, 255, 255], [0, 0, 255], [255, 0, 255],
    ]  # fmt: skip
    greys = [[255] * 3, [128] * 3, [0] * 3]
    assert found["map"] == [*greys, [0, 255, 0], [255, 0, 0], [255, 255, 0], [112, 137, 134]]
    assert found["costmap"] == [
        [0, 0, 0, 0], [2, 0, 253, 255], [127, 0, 128, 255], [249, 0, 6, 255], [0, 255, 255, 255],
        [255, 0, 255, 255], [255, 255, 0, 255],
    ]  # fmt: skip
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
        {"Later": "007", "Topic": {"Value": "/b", "Depth": "5"},
            "Shape": {"Value": "Axes", "Color": "1; 2; 3"}, "Alpha": "0.0299999993",
            "Covariance": {"Position": {"Value": "false"}}},
        False,
    ]  # fmt: skip


def test_defaults_are_those_of_rviz(tab: Tab) -> None:
    config = read_rviz(file_of_tests("golden/rviz_defaults.rviz").read_bytes())
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


MARKERS = """async () => {
  const { MarkerArray } = await import("/scene/displays/markers.js");
  const { Batches } = await import("/scene/marker_parts.js");
  const scene = { now: () => 0n, poseOf: () => [0, 0, 0, 0, 0, 0, 1], noteStatus() {}, invalidate() {} };
  const display = new MarkerArray({ ...scene, frames: {} }, [], {});
  display.batches = new Batches(display.root);
  display.begin = () => {};
  display.shown = new Map();
  display.namespaces = new Map();
  display.isPartShown = () => true;
  const marker = (type, x, a) => ({ action: 0, ns: "a", id: 1, type, points: [], colors: [], lifetime: 0n,
    header: { frame_id: "map", stamp: 0n }, frame_locked: false, text: "",
    color: { r: x, g: 0, b: 0, a }, scale: { x, y: 1, z: 1 },
    pose: { position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
  const { batches } = display;
  const part = () => display.shown.get("a/1").part;
  display.take(marker(1, 0.5, 1));
  const first = part();
  display.take(marker(1, 1, 1));
  const { min, max } = first.batch.box(first.index);
  const found = [part() === first, min.x, max.x, first.batch.words[12]];
  display.take(marker(1, 1, 0.25)); // transparent: an object of its own
  const mesh = part().object.children[0].children[0];
  found.push(batches.all.size, mesh.scale.x, mesh.material.opacity);
  display.take(marker(2, 1, 1));
  const { children } = display.root;
  return [...found, batches.all.size, children.length, children[0] === part().batch.object];
}"""


def test_a_marker_that_is_sent_again_keeps_its_object(tab: Tab) -> None:
    assert tab.evaluate(MARKERS) == [True, 0.5, 1.5, 1, 0, 1, 0.25, 1, 1, True]


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
