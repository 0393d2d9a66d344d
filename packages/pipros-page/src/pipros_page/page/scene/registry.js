// The displays that exist, by class. Others are listed, and keep their configuration.

import { Display } from "./display.js";
import { Camera } from "./displays/camera.js";
import { LaserScan, PointCloud2, Spot } from "./displays/clouds.js";
import { DepthCloud } from "./displays/depth.js";
import { Image } from "./displays/image.js";
import { InteractiveMarkers } from "./displays/interactive.js";
import { MapDisplay } from "./displays/map.js";
import { Marker, MarkerArray } from "./displays/markers.js";
import { GridCells, Odometry, Path, PointStamped, Polygon, Pose, PoseArray, PoseWithCovariance, Range } from "./displays/poses.js";
import { Axes, Grid } from "./displays/simple.js";
import { RobotModel } from "./displays/robot.js";
import { Imu, WrenchStamped } from "./displays/sensors.js";
import { Tf } from "./displays/tf.js";
import { className } from "./properties.js";
import { DISPLAYS } from "./schema.js";

class Group extends Display {
  constructor(scene, schema, config) {
    super(scene, schema, config);
    if (!Array.isArray(config.Displays)) config.Displays = [];
    this.displays = config.Displays.map((each) => makeDisplay(scene, each));
  }

  begin() {
    for (const display of this.displays) if (display.isEnabled) display.turnOn();
  }

  end() {
    for (const display of this.displays) display.turnOff();
  }

  changed() {}

  reset() {}

  restart() {}

  close() {
    for (const display of this.displays) display.close();
    super.close();
  }
}

class Unsupported extends Display {
  begin() {
    this.setStatus("Class", "error", `The class ${this.config.Class} is not supported; its configuration is kept.`);
  }
}

const CLASSES = {
  "rviz/Axes": Axes,
  "rviz/Camera": Camera,
  "rviz/DepthCloud": DepthCloud,
  "rviz/Grid": Grid,
  "rviz/FluidPressure": Spot,
  "rviz/GridCells": GridCells,
  "rviz/Group": Group,
  "rviz/Illuminance": Spot,
  "rviz/Image": Image,
  "rviz/InteractiveMarkers": InteractiveMarkers,
  "rviz/LaserScan": LaserScan,
  "rviz/Map": MapDisplay,
  "rviz/Marker": Marker,
  "rviz/MarkerArray": MarkerArray,
  "rviz/Odometry": Odometry,
  "rviz/Path": Path,
  "rviz/PointCloud": PointCloud2,
  "rviz/PointCloud2": PointCloud2,
  "rviz/PointStamped": PointStamped,
  "rviz/Polygon": Polygon,
  "rviz/Pose": Pose,
  "rviz/PoseArray": PoseArray,
  "rviz/PoseWithCovariance": PoseWithCovariance,
  "rviz/Range": Range,
  "rviz/RelativeHumidity": Spot,
  "rviz/RobotModel": RobotModel,
  "rviz/TF": Tf,
  "rviz/Temperature": Spot,
  "rviz/WrenchStamped": WrenchStamped,
  "rviz_imu_plugin/Imu": Imu,
};

export const SUPPORTED = Object.keys(CLASSES);

export function makeDisplay(scene, config) {
  const kind = className(config?.Class ?? "");
  const Kind = CLASSES[kind] ?? Unsupported;
  return new Kind(scene, DISPLAYS[kind] ?? [], typeof config === "object" && config ? config : {});
}
