import assert from "node:assert/strict";
import test from "node:test";
import { fixedFrameOf, robotLayout, sceneState } from "../page/panels/robot_layout.js";

const topic = (name, type, publishers = ["/robot"]) => ({ name, type, publishers });
const TOPICS = [topic("/move_base/costmap", "nav_msgs/OccupancyGrid"), topic("/map", "nav_msgs/OccupancyGrid"),
  topic("/scan", "sensor_msgs/LaserScan"), topic("/points", "sensor_msgs/PointCloud2"), topic("/plan", "nav_msgs/Path", []),
  topic("/left/image_raw", "sensor_msgs/Image"), topic("/right/image_raw", "sensor_msgs/Image"), topic("/odom", "nav_msgs/Odometry")];

test("the scene has what is published", () => {
  const { displays, options } = sceneState(TOPICS, [{ frame: "odom", parent: "map" }], true);
  assert.deepEqual(displays.map(({ Class, Topic }) => [Class, Topic]), [["rviz/Grid", undefined], ["rviz/Map", "/map"],
    ["rviz/Map", "/move_base/costmap"], ["rviz/LaserScan", "/scan"],
    ["rviz/PointCloud2", "/points"], ["rviz/RobotModel", undefined]]);
  assert.equal(options["Fixed Frame"], "map");
  const without = sceneState([topic("/points", "sensor_msgs/PointCloud2")], [], false);
  assert.deepEqual(without.displays.map(({ Class }) => Class), ["rviz/Grid", "rviz/PointCloud2", "rviz/TF"]);
});

test("markers are shown, and the base of the robot is in the middle", () => {
  const frames = [["odom", "map"], ["base_link", "odom"], ["arm", "base_link"]]
    .map(([frame, parent]) => ({ frame, parent, static: false }));
  const middle = (list) => sceneState(TOPICS, list, false).view["Target Frame"];
  assert.equal(middle(frames), "base_link");
  assert.equal(middle(frames.map((each) => ({ ...each, frame: `/r1/${each.frame}`, parent: `/r1/${each.parent}` }))), "/r1/base_link");
  assert.equal(middle([{ frame: "tool", parent: "world", static: false }, { frame: "lens", parent: "tool", static: true }]), "tool");
  assert.equal(middle([]), "<Fixed Frame>");
  const markers = [topic("/docks", "visualization_msgs/MarkerArray"), topic("/goal", "visualization_msgs/Marker")];
  const { displays } = sceneState(markers, frames, false);
  assert.deepEqual(displays.slice(1).map((each) => [each.Class, each["Marker Topic"] ?? each["Show Names"]]),
    [["rviz/MarkerArray", "/docks"], ["rviz/Marker", "/goal"], ["rviz/TF", "true"]]);
});

test("the fixed frame is a usual one, or the root of most frames", () => {
  assert.equal(fixedFrameOf([{ frame: "base", parent: "odom" }]), "odom");
  const links = [["a", "root"], ["b", "a"], ["c", "other"]].map(([frame, parent]) => ({ frame, parent }));
  assert.equal(fixedFrameOf(links), "root");
  assert.equal(fixedFrameOf([{ frame: "a", parent: "b" }, { frame: "b", parent: "a" }]).length, 1); // a loop ends
});

test("scene, cameras, plot and console are side by side", () => {
  assert.equal(robotLayout(TOPICS, "LINK"), "row(scene/LINK*60~column(images//left/image_raw*30~images//right/image_raw*30"
    + "~plot//odom/twist/twist/linear/x,/odom/twist/twist/angular/z*20~console*20)*40)");
  assert.equal(robotLayout([], "LINK"), "row(scene/LINK*60~column(plot*50~console*50)*40)");
});

test("a camera precedes images of other topics, whose names are shorter", () => {
  const image = (name) => topic(name, "sensor_msgs/Image");
  assert.match(robotLayout([image("/i/f64"), image("/i/f32"), image("/camera/image_raw")], "LINK"),
    /images\/\/camera\/image_raw\*30~images\/\/i\/f32\*30/);
  assert.match(robotLayout([image("/camera/depth"), image("/camera/color/image_raw")], "LINK"), /images\/\/camera\/color\/image_raw\*30~/);
});
