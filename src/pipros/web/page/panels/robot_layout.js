// The layout "Robot": the scene with map, scan, path and robot, two cameras, a plot and the console, as far as the topics exist.

import { layoutText, leaf } from "./layout.js";

const MOST = 2; // topics of a kind
const KINDS = [["nav_msgs/OccupancyGrid", "rviz/Map", "Map"], ["sensor_msgs/LaserScan", "rviz/LaserScan", "Scan"],
  ["nav_msgs/Path", "rviz/Path", "Path"]];
const CURVES = [
  { type: "nav_msgs/Odometry", fields: ["/twist/twist/linear/x", "/twist/twist/angular/z"] },
  { type: "sensor_msgs/Imu", fields: ["/angular_velocity/z"] },
  { type: "geometry_msgs/Twist", fields: ["/linear/x", "/angular/z"] },
];
const CAMERAS = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];
const WORLD = ["map", "odom", "world"];

// Returns the names of at most two published topics of a type, the shortest first.
function namesOf(topics, type) {
  const names = topics.filter((each) => each.type === type && each.publishers.length).map(({ name }) => name);
  return names.sort((one, other) => one.length - other.length || (one < other ? -1 : 1)).slice(0, MOST);
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

// Returns the state of the scene, as in its link.
export function sceneState(topics, frames, hasRobot) {
  const display = (Class, Name, more = {}) => ({ Class, Name, Enabled: "true", Value: "true", ...more });
  const clouds = namesOf(topics, "sensor_msgs/LaserScan").length ? [] : namesOf(topics, "sensor_msgs/PointCloud2").slice(0, 1);
  const displays = [
    display("rviz/Grid", "Grid"),
    ...KINDS.flatMap(([type, Class, title]) => namesOf(topics, type).map((name) => display(Class, `${title} ${name}`, { Topic: name }))),
    ...clouds.map((name) => display("rviz/PointCloud2", `Cloud ${name}`, { Topic: name })),
    ...(hasRobot ? [display("rviz/RobotModel", "Robot")] : [display("rviz/TF", "TF")]),
  ];
  return { options: { "Fixed Frame": fixedFrameOf(frames) }, displays, view: { Class: "rviz/Orbit", Name: "Current View" } };
}

// Returns the curves of the first topic that reports movement.
function curvesOf(topics) {
  for (const { type, fields } of CURVES) {
    const [name] = namesOf(topics, type);
    if (name) return fields.map((field) => name + field);
  }
  return [];
}

// Returns the text of the layout of panels. `link` is that of the scene.
export function robotLayout(topics, link) {
  const raw = namesOf(topics, CAMERAS[0]);
  const cameras = (raw.length ? raw : namesOf(topics, CAMERAS[1])).map((name) => leaf("images", name));
  const curves = curvesOf(topics);
  const split = (direction, parts, sizes) => (parts.length === 1 ? parts[0] : { direction, parts, sizes });
  const beside = cameras.length ? [split("row", cameras, cameras.map(() => 100 / cameras.length))] : [];
  const column = [...beside, leaf("plot", curves.join(",")), leaf("console")];
  return layoutText(split("row", [leaf("scene", link), split("column", column, column.map(() => 100 / column.length))], [60, 40]));
}
