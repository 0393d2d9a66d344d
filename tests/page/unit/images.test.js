import assert from "node:assert/strict";
import test from "node:test";
import { COLOUR_MAPS, numberText, paletteOf, unsupportedTransport } from "../page/image_colours.js";

test("colour maps begin and end with their colours", () => {
  const ends = Object.fromEntries(COLOUR_MAPS.map((name) => [name, [...paletteOf(name)]].map((each, at) => (at ? [each.slice(0, 3),
    each.slice(-3)] : each))));
  assert.deepEqual(ends, { grey: [[0, 0, 0], [255, 255, 255]], rainbow: [[255, 0, 0], [255, 0, 255]], heat: [[0, 0, 0], [255, 255, 255]] });
  assert.deepEqual([...paletteOf("heat").slice(85 * 3, 86 * 3)], [255, 0, 0]);
});

test("numbers have six digits, and depths their unit", () => {
  assert.deepEqual([numberText(1.23456789, true), numberText(517, false), numberText(NaN, true)], ["1.23457 m", "517", "NaN"]);
});

test("transports that are not decoded name republish", () => {
  assert.equal(unsupportedTransport({ name: "/a/image", type: "sensor_msgs/Image" }), "");
  assert.match(unsupportedTransport({ name: "/a/image/theora", type: "theora_image_transport/Packet" }),
    /^The transport theora .* republish theora in:=\/a\/image raw out:=\/a\/image\/republished$/);
  assert.match(unsupportedTransport({ name: "/cam", type: "foxglove_msgs/CompressedVideo" }), /^The transport h264 /);
});
