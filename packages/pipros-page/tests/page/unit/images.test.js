import assert from "node:assert/strict";
import test from "node:test";
import { imagesText, isOverlay, parsedImages } from "../page/image_address.js";
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

test("the text for a transport that is not decoded names republish", () => {
  assert.equal(unsupportedTransport({ name: "/a/image", type: "sensor_msgs/Image" }), "");
  assert.match(unsupportedTransport({ name: "/a/image/theora", type: "theora_image_transport/Packet" }),
    /^The transport theora .* republish theora in:=\/a\/image raw out:=\/a\/image\/republished$/);
  assert.match(unsupportedTransport({ name: "/cam", type: "foxglove_msgs/CompressedVideo" }), /^The transport h264 /);
});

test("addresses name a pair, how it is shown, and an overlay", () => {
  const all = { topic: "/left/image", other: "/right/image", isDifference: true, overlay: "/found" };
  const text = "/left/image;with=/right/image;show=difference;over=/found";
  assert.equal(imagesText(all), text);
  assert.deepEqual(parsedImages(text), all);
  assert.deepEqual(parsedImages("/a;show=difference"), { topic: "/a", other: "", isDifference: false, overlay: "" });
  assert.equal(imagesText({ topic: "", other: "", isDifference: false, overlay: "" }), "");
  assert.deepEqual(["vision_msgs/Detection2DArray", "visualization_msgs/Marker", "vision_msgs/Detection3DArray", undefined].map(isOverlay),
    [true, true, false, false]);
});

test("the format of a compressed image names its transport", () => {
  assert.match(unsupportedTransport({ name: "/cam/image/compressed", type: "h264" }),
    /transport h264 .* republish h264 in:=\/cam\/image raw/);
  for (const type of ["jpeg", "bgr8; png compressed", "16UC1; compressedDepth", ""])
    assert.equal(unsupportedTransport({ name: "/a", type }), "");
});
