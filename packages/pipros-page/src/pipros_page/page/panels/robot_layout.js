// The Overview: the scene of the robot and what it sees, two cameras, a plot and the console, as far as the topics exist.

import { layoutText, leaf } from "./layout.js";

const MOST = 2; // topics of a kind
// Type, display, title, property of the topic, and maximum number.
const KINDS = [["nav_msgs/OccupancyGrid", "rviz/Map", "Map", "Topic", MOST],
  ["sensor_msgs/LaserScan", "rviz/LaserScan", "Scan", "Topic", MOST],
  ["sensor_msgs/PointCloud2", "rviz/PointCloud2", "Cloud", "Topic", 1], ["nav_msgs/Path", "rviz/Path", "Path", "Topic", MOST],
  ["visualization_msgs/MarkerArray", "rviz/MarkerArray", "Markers", "Marker Topic", MOST],
  ["visualization_msgs/Marker", "rviz/Marker", "Marker", "Marker Topic", MOST]];
const BASES = ["base_footprint", "base_link"];
const DISTANCES = { "nav_msgs/OccupancyGrid": 12, "sensor_msgs/PointCloud2": 10, "sensor_msgs/LaserScan": 8 }; // of the camera in metres
const NEAR = 5; // if there is neither a map nor a sensor
const FEW_FRAMES = 4; // of more frames, the names would lie on each other
const CURVES = [
  { type: "nav_msgs/Odometry", fields: ["/twist/twist/linear/x", "/twist/twist/angular/z"] },
  { type: "sensor_msgs/Imu", fields: ["/angular_velocity/z"] },
  { type: "geometry_msgs/Twist", fields: ["/linear/x", "/angular/z"] },
];
const CAMERAS = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];
// Names of topics with pictures for people. Others may contain numbers that nobody can look at.
const USUAL = /^(?!.*(depth|disparity|infra|label|mask)).*(image|camera|rgb|color)/i;
const CAMERA_SHARE = 60; // percent of the column beside the scene
const WORLD = ["map", "odom", "world"];

// Returns the names of at most two published topics of a type: those that match `usual` first, and then the shortest.
function namesOf(topics, type, usual = /^/) {
  const names = topics.filter((each) => each.type === type && each.publishers.length).map(({ name }) => name);
  const rank = (name) => name.length + (usual.test(name) ? 0 : 1e6);
  return names.sort((one, other) => rank(one) - rank(other) || (one < other ? -1 : 1)).slice(0, MOST);
}

// Returns the fixed frame: the usual one, or the root of most frames. `frames` has {frame, parent}.
export function fixedFrameOf(frames) {
  const parents = new Map(frames.map(({ frame, parent }) => [frame, parent]));
  const usual = WORLD.find((name) => parents.has(name) || frames.some(({ parent }) => parent === name));
  if (usual) return usual;
  const counts = new Map();
  for (let { frame } of frames) {
    for (let left = frames.length; left > 0 && parents.has(frame); left -= 1) frame = parents.get(frame);
    counts.set(frame, (counts.get(frame) ?? 0) + 1);
  }
  return [...counts].sort((one, other) => other[1] - one[1])[0]?.[0] ?? "map";
}

// Returns the frame in the middle: the usual base of a robot, also in its namespace, or the last moving frame.
function middleOf(frames) {
  const names = frames.map(({ frame }) => frame);
  const moving = frames.filter((each) => !each.static).map(({ frame }) => frame);
  return BASES.flatMap((base) => [base, ...names.filter((name) => name.endsWith(`/${base}`))]).find((name) => names.includes(name))
    ?? moving.findLast((name) => !frames.some((each) => each.parent === name && moving.includes(each.frame))) ?? "<Fixed Frame>";
}

// Returns the state of the scene, as in its link.
export function sceneState(topics, frames, hasRobot) {
  const display = (Class, Name, more = {}) => ({ Class, Name, Enabled: "true", Value: "true", ...more });
  const displays = [
    display("rviz/Grid", "Grid"),
    ...KINDS.flatMap(([type, Class, title, property, most]) => namesOf(topics, type).slice(0, most)
      .map((name) => display(Class, `${title} ${name}`, { [property]: name }))),
    hasRobot ? display("rviz/RobotModel", "Robot") : display("rviz/TF", "TF", { "Show Names": String(frames.length <= FEW_FRAMES) }),
  ];
  const [, Distance] = Object.entries(DISTANCES).find(([type]) => namesOf(topics, type).length) ?? ["", NEAR];
  const view = { Class: "rviz/Orbit", Name: "Current View", "Target Frame": middleOf(frames), Distance: String(Distance) };
  return { options: { "Fixed Frame": fixedFrameOf(frames) }, displays, view };
}

// Returns the curves of the first topic that reports movement.
function curvesOf(topics) {
  for (const { type, fields } of CURVES) {
    const [name] = namesOf(topics, type);
    if (name) return fields.map((field) => name + field);
  }
  return [];
}

// Returns the names of at most two topics with pictures, raw ones if there are any.
export const camerasOf = (topics) => CAMERAS.map((type) => namesOf(topics, type, USUAL)).find((names) => names.length) ?? [];

// Returns the text of the layout of panels. `link` is that of the scene.
export function robotLayout(topics, link) {
  const cameras = camerasOf(topics).map((name) => leaf("images", name));
  const curves = curvesOf(topics);
  const split = (direction, parts, sizes) => ({ direction, parts, sizes });
  const column = [...cameras, leaf("plot", curves.join(",")), leaf("console")];
  const rest = cameras.length ? 100 - CAMERA_SHARE : 100;
  const sizes = column.map(({ tab }) => (tab === "images" ? CAMERA_SHARE / cameras.length : rest / 2));
  return layoutText(split("row", [leaf("scene", link), split("column", column, sizes)], [60, 40]));
}
