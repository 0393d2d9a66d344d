import assert from "node:assert/strict";
import test from "node:test";
import { MAX_PANELS, appended, beside, layoutText, leaf, leavesOf, moved, parsedLayout, placesOf, resized, withLeaf,
  without } from "../page/panels/layout.js";
import { TimeLink } from "../page/panels/time_link.js";
import { completed, placeIn, placeOf } from "../page/place.js";
import { VECTORS, close } from "./vectors.js";

const TABS = ["plot", "console", "images", "topics"];
const boxesOf = (layout) => placesOf(layout).panels.map(({ box: { x, y, w, h } }) => [x, y, w, h]);
const named = (layout) => leavesOf(layout).map(({ tab }) => tab);

test("texts become the panels and boxes that their numbers mean", () => {
  assert.ok(VECTORS.layouts.length > 200);
  for (const [text, panels] of VECTORS.layouts) {
    const layout = parsedLayout(text, TABS);
    const wanted = panels.map(([tab, argument]) => [tab, completed(tab, argument)]);
    assert.deepEqual(leavesOf(layout).map(({ tab, argument }) => [tab, argument]), wanted, text);
    boxesOf(layout).forEach((box, index) => close(box, panels[index][2], 1e-9, text));
    const again = parsedLayout(layoutText(layout), TABS);
    boxesOf(again).forEach((box, index) => close(box, panels[index][2], 0.1, "written and read"));
  }
});

test("malformed texts are errors that name the place", () => {
  for (const [text, reason] of [
    ["row(plot", /lacks a closing bracket, at character 9/], ["nothing", /names an unknown view, nothing/],
      ["row(~)", /lacks the name of a view/],
    ["plot)", /has more text than expected/], [`${"row(".repeat(30)}plot`, /more than 20 levels/],
    [`row(${Array.from({ length: MAX_PANELS + 1 }, () => "plot").join("~")})`, /more than 16 panels/],
  ]) assert.throws(() => parsedLayout(text, TABS), reason);
  assert.equal(parsedLayout("", TABS), null);
  assert.equal(layoutText(null), "");
});

test("panels are added, moved, exchanged and removed", () => {
  const [plot, images] = [leaf("plot"), leaf("images")];
  const two = appended(appended(null, plot, 2), images, 2);
  assert.equal(layoutText(two), "row(plot*50~images*50)");
  const three = beside(two, images.id, "above", leaf("console"));
  assert.equal(layoutText(three), "row(plot*50~column(console*50~images*50)*50)");
  assert.deepEqual(named(moved(three, plot.id, images.id, "centre")), ["images", "console", "plot"]);
  assert.equal(layoutText(moved(three, plot.id, images.id, "left")), "column(console*50~row(plot*50~images*50)*50)");
  assert.equal(moved(three, plot.id, plot.id, "left"), three);
  assert.deepEqual(named(withLeaf(three, { ...plot, tab: "topics" })), ["topics", "console", "images"]);
  assert.equal(without(without(two, plot.id), images.id), null);
  assert.equal(layoutText(appended(three, leaf("topics"), 0.5)), "row(column(plot*50~topics*50)*50~column(console*50~images*50)*50)");
});

test("borders move, but leave each panel some room", () => {
  const layout = parsedLayout("row(plot*60~column(images*50~console*50)*40)", TABS);
  assert.deepEqual(resized(layout, [], 0, 10).sizes, [70, 30]);
  assert.deepEqual(resized(layout, [], 0, 90).sizes, [95, 5]);
  assert.deepEqual(resized(layout, [1], 0, -20).parts[1].sizes, [30, 70]);
  const [vertical, horizontal] = [...placesOf(layout).borders].sort((one, other) => one.path.length - other.path.length);
  assert.deepEqual([vertical.box, horizontal.box], [{ x: 60, y: 0, w: 0, h: 100 }, { x: 60, y: 50, w: 40, h: 0 }]);
  assert.deepEqual(placesOf(null), { panels: [], borders: [] });
});

test("addresses are read back", () => {
  assert.equal(placeOf("graph"), "#graph");
  assert.deepEqual(placeIn(placeOf("plot", "/a b/x:ü@3")), ["plot", "/a b/x:ü@3"]);
  assert.equal(placeOf("plot", "/imu/x:y"), "#plot//imu/x:y");
  assert.deepEqual(placeIn("#plot/%zz"), ["plot", "%zz"]);
});

test("linked plots have the times of all, and others their own", () => {
  const times = new TimeLink();
  assert.deepEqual(times.range("a", 10, 12), [10, 12]);
  assert.deepEqual(times.range("b", 11, 15), [10, 15]);
  times.isOn = false;
  assert.deepEqual(times.range("b", 11, 15), [11, 15]);
  times.isOn = true;
  times.forget("b");
  assert.deepEqual(times.range("a", 10, 13), [10, 13]);
});

test("names in addresses may lack their leading slash", () => {
  for (const [tab, argument, whole] of [
    ["topics", "odom", "/odom"], ["topics", "/odom", "/odom"], ["topics", "", ""], ["images", "left/image;with=right/image;over=/found",
      "/left/image;with=/right/image;over=/found"], ["images", ";with=a", ";with=/a"], ["graph", "node:robot", "node:/robot"],
    ["graph", "topic:/imu;mode=all", "topic:/imu;mode=all"], ["graph", ";mode=all", ";mode=all"], ["graph", "events:", "events:"],
    ["tf", "/base_link>/camera", "base_link>camera"], ["bags", "run.bag", "run.bag"], ["teleop", "cmd_vel", "/cmd_vel"],
  ]) assert.equal(completed(tab, argument), whole, `${tab}/${argument}`);
  assert.deepEqual(placeIn("#services/robot/reset"), ["services", "/robot/reset"]);
  assert.equal(leavesOf(parsedLayout("row(images/camera/image~console)", TABS))[0].argument, "/camera/image");
});
