// Properties of displays, views and the global options: one table per class, with rviz's names and defaults.

// A property: [name, kind, default, options or children]. Kinds: bool, int, float, text, enum, colour, topic, frame,
// vector, group (children only), switch (a bool with children), choice (an enum with children).

const topic = (type, name = "Topic", fallback = "") => [name, "topic", fallback, type];
const QUEUE = ["Queue Size", "int", 10];
const COMMON = [["Unreliable", "bool", false], QUEUE];
const ALPHA = ["Alpha", "float", 1];
const NO_OFFSET = ["Offset", "vector", [0, 0, 0]];

const CLOUD = [
  ["Selectable", "bool", true],
  ["Style", "enum", "Flat Squares", ["Points", "Squares", "Flat Squares", "Spheres", "Boxes"]],
  ["Size (m)", "float", 0.01],
  ["Size (Pixels)", "float", 3],
  ALPHA,
  ["Decay Time", "float", 0],
  ["Position Transformer", "enum", "XYZ", ["XYZ"]],
  ["Color Transformer", "enum", "", ["Intensity", "AxisColor", "FlatColor", "RGB8", "MONO8", "RGBF32"]],
  ["Channel Name", "text", "intensity"],
  ["Use rainbow", "bool", true],
  ["Invert Rainbow", "bool", false],
  ["Min Color", "colour", [0, 0, 0]],
  ["Max Color", "colour", [255, 255, 255]],
  ["Autocompute Intensity Bounds", "bool", true],
  ["Min Intensity", "float", 0],
  ["Max Intensity", "float", 4096],
  ["Color", "colour", [255, 255, 255]],
  ["Axis", "enum", "Z", ["X", "Y", "Z"]],
  ["Autocompute Value Bounds", "switch", true, [["Min Value", "float", -10], ["Max Value", "float", 10]]],
  ["Use Fixed Frame", "bool", true],
];

// The properties of a display of a sensor's single number, which rviz draws as a cloud of one point.
const spot = (kind, channel, low, high, more = {}) => {
  const own = { "Channel Name": channel, "Autocompute Intensity Bounds": false, "Min Intensity": low, "Max Intensity": high, ...more };
  const rows = CLOUD.map(([name, type, fallback, options]) => [name, type, own[String(name)] ?? fallback, options]);
  return [topic(`sensor_msgs/${kind}`), ...COMMON, ...rows];
};

const IMAGE = [
  topic("sensor_msgs/Image", "Image Topic"),
  ["Transport Hint", "text", "raw"],
  ["Queue Size", "int", 2],
  ["Unreliable", "bool", false],
];

const POSE_SHAPE = [
  ["Shape", "enum", "Arrow", ["Arrow", "Axes"]],
  ["Color", "colour", [255, 25, 0]],
  ALPHA,
  ["Shaft Length", "float", 1],
  ["Shaft Radius", "float", 0.05],
  ["Head Length", "float", 0.3],
  ["Head Radius", "float", 0.1],
  ["Axes Length", "float", 1],
  ["Axes Radius", "float", 0.1],
];

const COVARIANCE = ["Covariance", "switch", true, [
  ["Position", "switch", true, [["Color", "colour", [204, 51, 204]], ["Alpha", "float", 0.3], ["Scale", "float", 1]]],
  ["Orientation", "switch", true, [
    ["Frame", "enum", "Local", ["Local", "Fixed"]],
    ["Color Style", "enum", "Unique", ["Unique", "RGB"]],
    ["Color", "colour", [255, 255, 127]],
    ["Alpha", "float", 0.5],
    ["Offset", "float", 1],
    ["Scale", "float", 1],
  ]],
]];

const MARKERS = [["Queue Size", "int", 100], ["Namespaces", "names", true]];

export const DISPLAYS = {
  "rviz/Group": [],
  "rviz/Grid": [
    ["Reference Frame", "frame", "<Fixed Frame>"],
    ["Plane Cell Count", "int", 10],
    ["Normal Cell Count", "int", 0],
    ["Cell Size", "float", 1],
    ["Line Style", "choice", "Lines", ["Lines", "Billboards"], [["Line Width", "float", 0.03]]],
    ["Color", "colour", [160, 160, 164]],
    ["Alpha", "float", 0.5],
    ["Plane", "enum", "XY", ["XY", "XZ", "YZ"]],
    NO_OFFSET,
  ],
  "rviz/Axes": [["Reference Frame", "frame", "<Fixed Frame>"], ["Length", "float", 1], ["Radius", "float", 0.1], ALPHA,
    ["Show Trail", "bool", false]],
  "rviz/TF": [
    ["Show Names", "bool", true],
    ["Show Axes", "bool", true],
    ["Show Arrows", "bool", true],
    ["Marker Scale", "float", 1],
    ["Marker Alpha", "float", 1],
    ["Update Interval", "float", 0],
    ["Frame Timeout", "float", 15],
    ["Filter (whitelist)", "text", ""],
    ["Filter (blacklist)", "text", ""],
    ["Frames", "group", null, [["All Enabled", "bool", true]]],
  ],
  "rviz/RobotModel": [
    ["Visual Enabled", "bool", true],
    ["Collision Enabled", "bool", false],
    ["Update Interval", "float", 0],
    ALPHA,
    ["Robot Description", "text", "robot_description"],
    ["TF Prefix", "text", ""],
    ["Links", "group", null, [["All Links Enabled", "bool", true]]],
  ],
  "rviz/PointCloud2": [topic("sensor_msgs/PointCloud2"), ...COMMON, ...CLOUD],
  "rviz/PointCloud": [topic("sensor_msgs/PointCloud"), ...COMMON, ...CLOUD],
  "rviz/LaserScan": [topic("sensor_msgs/LaserScan"), ...COMMON, ...CLOUD],
  "rviz/Temperature": spot("Temperature", "temperature", 0, 100, { "Invert Rainbow": true }),
  "rviz/FluidPressure": spot("FluidPressure", "fluid_pressure", 98000, 105000),
  "rviz/Illuminance": spot("Illuminance", "illuminance", 0, 1000),
  "rviz/RelativeHumidity": spot("RelativeHumidity", "relative_humidity", 0, 1),
  "rviz/Map": [
    topic("nav_msgs/OccupancyGrid"),
    ["Alpha", "float", 0.7],
    ["Color Scheme", "enum", "map", ["map", "costmap", "raw"]],
    ["Draw Behind", "bool", false],
    ["Unreliable", "bool", false],
    ["Use Timestamp", "bool", false],
  ],
  "rviz/Path": [
    topic("nav_msgs/Path"),
    ...COMMON,
    ["Line Style", "enum", "Lines", ["Lines", "Billboards"]],
    ["Line Width", "float", 0.03],
    ["Color", "colour", [25, 255, 0]],
    ALPHA,
    ["Buffer Length", "int", 1],
    NO_OFFSET,
    ["Pose Style", "enum", "None", ["None", "Axes", "Arrows"]],
    ["Pose Color", "colour", [255, 85, 255]],
    ["Length", "float", 0.3],
    ["Radius", "float", 0.03],
    ["Shaft Length", "float", 0.1],
    ["Head Length", "float", 0.2],
    ["Shaft Diameter", "float", 0.1],
    ["Head Diameter", "float", 0.3],
  ],
  "rviz/Pose": [topic("geometry_msgs/PoseStamped"), ...COMMON, ...POSE_SHAPE],
  "rviz/PoseWithCovariance": [topic("geometry_msgs/PoseWithCovarianceStamped"), ...COMMON, ...POSE_SHAPE, COVARIANCE],
  "rviz/PoseArray": [
    topic("geometry_msgs/PoseArray"),
    ...COMMON,
    ["Shape", "enum", "Arrow (Flat)", ["Arrow (Flat)", "Arrow (3D)", "Axes"]],
    ["Color", "colour", [255, 25, 0]],
    ALPHA,
    ["Arrow Length", "float", 0.3],
    ["Head Radius", "float", 0.03],
    ["Head Length", "float", 0.07],
    ["Shaft Radius", "float", 0.01],
    ["Shaft Length", "float", 0.23],
    ["Axes Length", "float", 0.3],
    ["Axes Radius", "float", 0.01],
  ],
  "rviz/Odometry": [
    topic("nav_msgs/Odometry"),
    ...COMMON,
    ["Position Tolerance", "float", 0.1],
    ["Angle Tolerance", "float", 0.1],
    ["Keep", "int", 100],
    ["Shape", "choice", "Arrow", ["Arrow", "Axes"], POSE_SHAPE.slice(1)],
    COVARIANCE,
  ],
  "rviz/Polygon": [topic("geometry_msgs/PolygonStamped"), ...COMMON, ["Color", "colour", [25, 255, 0]], ALPHA],
  "rviz/PointStamped": [topic("geometry_msgs/PointStamped"), ...COMMON, ["Color", "colour", [204, 41, 204]], ALPHA,
    ["Radius", "float", 0.2], ["History Length", "int", 1]],
  "rviz/GridCells": [topic("nav_msgs/GridCells"), ...COMMON, ["Color", "colour", [25, 255, 0]], ALPHA],
  "rviz/Range": [topic("sensor_msgs/Range"), ...COMMON, ["Color", "colour", [255, 255, 255]], ["Alpha", "float", 0.5],
    ["Buffer Length", "int", 1]],
  "rviz/WrenchStamped": [
    topic("geometry_msgs/WrenchStamped"),
    ...COMMON,
    ["Force Color", "colour", [204, 51, 51]],
    ["Torque Color", "colour", [204, 204, 51]],
    ALPHA,
    ["Force Arrow Scale", "float", 2],
    ["Torque Arrow Scale", "float", 2],
    ["Arrow Width", "float", 0.5],
    ["History Length", "int", 1],
    ["Hide Small Values", "bool", true],
  ],
  "rviz_imu_plugin/Imu": [
    topic("sensor_msgs/Imu"),
    ...COMMON,
    ["fixed_frame_orientation", "bool", true],
    ["Box properties", "group", null, [
      ["Enable box", "bool", true],
      ["x_scale", "float", 1],
      ["y_scale", "float", 1],
      ["z_scale", "float", 1],
      ["Box color", "colour", [255, 0, 0]],
      ["Box alpha", "float", 1],
    ]],
    ["Axes properties", "group", null, [["Enable axes", "bool", true], ["Axes scale", "float", 1]]],
    ["Acceleration properties", "group", null, [
      ["Enable acceleration", "bool", true],
      ["Derotate acceleration", "bool", true],
      ["Acc. vector scale", "float", 1],
      ["Acc. vector color", "colour", [255, 0, 0]],
      ["Acc. vector alpha", "float", 1],
    ]],
  ],
  "rviz/Marker": [topic("visualization_msgs/Marker", "Marker Topic", "visualization_marker"), ...MARKERS],
  "rviz/MarkerArray": [topic("visualization_msgs/MarkerArray", "Marker Topic", "visualization_marker_array"), ...MARKERS],
  "rviz/InteractiveMarkers": [
    topic("visualization_msgs/InteractiveMarkerUpdate", "Update Topic"),
    ["Show Descriptions", "bool", true],
    ["Show Axes", "bool", false],
    ["Show Visual Aids", "bool", false],
    ["Enable Transparency", "bool", true],
  ],
  "rviz/DepthCloud": [
    ["Topic Filter", "bool", true],
    topic("sensor_msgs/Image", "Depth Map Topic"),
    ["Depth Map Transport Hint", "text", "raw"],
    topic("sensor_msgs/Image", "Color Image Topic"),
    ["Color Transport Hint", "text", "raw"],
    ["Queue Size", "int", 5],
    ["Auto Size", "switch", true, [["Auto Size Factor", "float", 1]]],
    ["Occlusion Compensation", "switch", false, [["Occlusion Time-Out", "float", 30]]],
    ...CLOUD,
  ],
  "rviz/Camera": [
    ...IMAGE,
    ["Image Rendering", "enum", "background and overlay", ["background", "overlay", "background and overlay"]],
    ["Overlay Alpha", "float", 0.5],
    ["Zoom Factor", "float", 1],
    ["Visibility", "names", true],
  ],
  "rviz/Image": [
    ...IMAGE,
    ["Normalize Range", "bool", true],
    ["Min Value", "float", 0],
    ["Max Value", "float", 1],
    ["Median window", "int", 5],
  ],
};

const ORBIT = [
  ["Distance", "float", 10],
  ["Yaw", "float", 0.785398],
  ["Pitch", "float", 0.785398],
  ["Focal Point", "vector", [0, 0, 0]],
  ["Field of View", "float", 0.785398],
  ["Focal Shape Size", "float", 0.05],
  ["Focal Shape Fixed Size", "bool", true],
];

const VIEW = [["Target Frame", "frame", "<Fixed Frame>"], ["Near Clip Distance", "float", 0.01], ["Invert Z Axis", "bool", false]];

export const VIEWS = {
  "rviz/Orbit": [...VIEW, ...ORBIT],
  "rviz/XYOrbit": [...VIEW, ...ORBIT],
  "rviz/ThirdPersonFollower": [...VIEW, ...ORBIT],
  "rviz/TopDownOrtho": [...VIEW, ["Scale", "float", 10], ["Angle", "float", 0], ["X", "float", 0], ["Y", "float", 0]],
  "rviz/FPS": [...VIEW, ["Yaw", "float", 0], ["Pitch", "float", 0], ["Roll", "float", 0], ["Position", "vector", [0, 0, 0]]],
};

export const GLOBAL = [
  ["Fixed Frame", "frame", "map"],
  ["Background Color", "colour", [48, 48, 48]],
  ["Frame Rate", "int", 30],
  ["Default Light", "bool", true],
];
