// The tools of rviz, with its names, keys and defaults.

export const TOOLS = {
  "rviz/Interact": { title: "Interact", key: "i" },
  "rviz/MoveCamera": { title: "Move Camera", key: "m" },
  "rviz/Select": { title: "Select", key: "s" },
  "rviz/FocusCamera": { title: "Focus Camera", key: "" },
  "rviz/Measure": { title: "Measure", key: "n" },
  "rviz/SetInitialPose": { title: "2D Pose Estimate", key: "p", topic: "/initialpose", type: "geometry_msgs/PoseWithCovarianceStamped",
    colour: [0, 255, 0] },
  "rviz/SetGoal": { title: "2D Nav Goal", key: "g", topic: "/move_base_simple/goal", type: "geometry_msgs/PoseStamped",
    colour: [255, 0, 255] },
  "rviz/PublishPoint": { title: "Publish Point", key: "c", topic: "/clicked_point", type: "geometry_msgs/PointStamped" },
};

// The properties of the tools that publish.
export const POSE = [
  ["Topic", "topic", ""],
  ["Single click", "bool", true],
  ["X std deviation", "float", 0.5],
  ["Y std deviation", "float", 0.5],
  ["Theta std deviation", "float", 0.261799],
];

// Returns the covariance of a pose, a matrix of 6 x 6 numbers.
export function covarianceOf(deviations) {
  const covariance = new Array(36).fill(0);
  covariance[0] = deviations.get("X std deviation") ** 2;
  covariance[7] = deviations.get("Y std deviation") ** 2;
  covariance[35] = deviations.get("Theta std deviation") ** 2;
  return covariance;
}
