"""Launch sets in the shapes of public robots' navigation packages, with the limits that they set.

The files that give the shapes are those of small robots (turtlebot3, linorobot), of robots with controllers
and multiplexers (husky, jackal), of platforms (freight, mir), of TurtleBot 2, and of worlds for Stage.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.sax.saxutils import escape, quoteattr

from pipros_workspace.index import SHARED_PACKAGES

MAP: Final = SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml"
START: Final = (2.9, 1.0, 1.2)
GOALS: Final = ((2.5, 2.6, 2.0), (2.2, 4.2, 0.0), (5.5, 4.2, 0.0), (5.5, 2.2, -1.5), (3.0, 1.7, 3.1))
TRAJECTORY: Final = "base_local_planner/TrajectoryPlannerROS"
DWA: Final = "dwa_local_planner/DWAPlannerROS"
TEB: Final = "teb_local_planner/TebLocalPlannerROS"
_TOLERANCES: Final = {"xy_goal_tolerance": 0.15, "yaw_goal_tolerance": 0.25}
_WHEELS: Final = [index in (6, 7, 11) for index in range(15)]
_YAW: Final = [index in (5, 11) for index in range(15)]


@dataclass(frozen=True)
class RobotSet:
    """A launch set.

    Attributes:
        speed, turn: the greatest speed in m/s and rate in rad/s that the parameters allow.
        parameters: parameters of the local planner.
        localisation: amcl, fake, gmapping, ekf+amcl, ukf+amcl, or ekf (no map).
        costmaps: static (old parameters), layers (lists of plugins), or rolling (also the global costmap).
        laser: scan, filtered, cloud, or heights (a VoxelLayer that keeps a band of heights).
        commands: from move_base to the robot: direct, twist_mux, smoother, or controllers (behind twist_mux).
        more: further parameters of move_base.
        robot: further settings of the robot in pipros_sim.
    """

    name: str
    planner: str
    speed: float
    turn: float
    parameters: Mapping[str, Any]
    localisation: str = "amcl"
    costmaps: str = "static"
    laser: str = "scan"
    commands: str = "direct"
    simulator: str = "pipros_sim"
    global_planner: str = "navfn/NavfnROS"
    more: Mapping[str, Any] = field(default_factory=dict)
    robot: Mapping[str, Any] = field(default_factory=dict)

    @property
    def has_map(self) -> bool:
        """Whether goals are on the map of `map_server`; otherwise, the origin is the start of the robot."""
        return self.localisation not in ("gmapping", "ekf")

    @property
    def members(self) -> list[str]:
        """The members of the lockstep; none if a node between scans and commands cannot be one."""
        if "fake" in self.localisation or self.laser in ("filtered", "cloud") or self.commands != "direct":
            return []
        names = {"ekf": "ekf", "ukf": "ukf", "amcl": "amcl", "gmapping": "slam_gmapping"}
        return [*(names[each] for each in self.localisation.split("+")), "move_base"]


def _dwa(speed: float, turn: float, **more: Any) -> dict[str, Any]:
    limits = {"max_vel_x": speed, "max_vel_trans": speed, "max_vel_theta": turn, "min_vel_trans": speed / 5}
    weights = {"path_distance_bias": 32.0, "goal_distance_bias": 20.0, "occdist_scale": 0.02}
    return {**limits, **weights, "max_vel_y": 0.0, "min_vel_y": 0.0, "min_vel_x": 0.0, **more}


def _trajectory(speed: float, turn: float, **more: Any) -> dict[str, Any]:
    limits = {"max_vel_x": speed, "max_vel_theta": turn, "min_vel_theta": -turn, "holonomic_robot": False}
    return {**limits, "min_in_place_vel_theta": turn / 3, **more}


def _set(name: str, planner: str, speed: float, turn: float, **more: Any) -> RobotSet:
    """Return a set whose planner has these limits, and the parameters `own` in addition."""
    given: dict[str, Any] = {**_TOLERANCES, **more.pop("own", {})}
    if given.pop("with_old_names", False):
        given |= {**_dwa(speed, turn), "min_trans_vel": speed / 5}
        for new in ("max_vel_trans", "max_vel_theta", "min_vel_trans"):
            del given[new]
    elif planner in (DWA, TRAJECTORY):
        given = (_dwa if planner == DWA else _trajectory)(speed, turn, **given)
    return RobotSet(name, planner, speed, turn, given, **more)


_MUX: Final = {"commands": "twist_mux", "localisation": "ekf+amcl"}
_STAGE: Final = {"simulator": "stageros"}
SETS: Final = (
    _set("small", DWA, 0.22, 1.8, own={"acc_lim_x": 2.5, "acc_lim_theta": 3.2}),
    _set("outdoor", DWA, 0.5, 1.0, **_MUX, costmaps="layers",
         more={"obstacle_range": 5.5, "raytrace_range": 6.0}),
    _set("controllers", TRAJECTORY, 0.5, 1.0, localisation="ekf+amcl", commands="controllers",
         costmaps="layers", own={
         "dwa": True, "vx_samples": 6, "vtheta_samples": 20, "meter_scoring": True, "pdist_scale": 0.75,
              "gdist_scale": 1.0, "occdist_scale": 0.1, "heading_lookahead": 0.325}),
    _set("hobby", DWA, 0.35, 1.5, localisation="ukf+amcl", global_planner="global_planner/GlobalPlanner",
         more={"GlobalPlanner": {"neutral_cost": 66, "use_dijkstra": True}}),
    _set("dwb", "dwb_local_planner/DWBLocalPlanner", 0.3, 1.0, localisation="ekf+amcl", own={
        "max_vel_x": 0.3, "max_speed_xy": 0.3, "max_vel_theta": 1.0, "acc_lim_x": 2.5, "acc_lim_theta": 3.2,
        "critics": [{"name": "GoalDist"}]}),
    _set("platform", TRAJECTORY, 0.6, 1.2, own={
        "dwa": False, "sim_time": 1.5, "meter_scoring": True, "pdist_scale": 2.2, "gdist_scale": 0.8}),
    _set("arm", TRAJECTORY, 0.4, 1.0, costmaps="layers", more={"with_foreign_layer": True}, own={
        "latch_xy_goal_tolerance": True, "vtheta_samples": 20, "escape_vel": 0.0}),
    _set("nodelet", DWA, 0.45, 1.5, commands="smoother", laser="heights"),
    _set("vacuum", TRAJECTORY, 0.2, 0.8, **_STAGE, localisation="fake", own={"acc_lim_x": 1.0}),
    _set("tutorial", TRAJECTORY, 0.65, 1.0, **_STAGE, costmaps="layers", own={
        "dwa": True, "pdist_scale": 0.9, "gdist_scale": 0.6}, more={"min_obstacle_height": 0.08}),
    _set("university", TRAJECTORY, 0.55, 1.0, own={
        "max_vel_x": 0.55, "acc_lim_th": 3.2, "heading_scoring": True, "heading_scoring_timestep": 0.8}),
    _set("factory", DWA, 0.6, 1.0, laser="cloud", own={"acc_lim_th": 2.0, "vtheta_samples": 30}),
    _set("teb", TEB, 0.3, 0.9, own={
        "max_vel_x": 0.3, "max_vel_x_backwards": 0.1, "max_vel_theta": 0.9, "acc_lim_x": 0.8,
        "acc_lim_theta": 1.2, "footprint_model": {"type": "point"}, "min_obstacle_dist": 0.2}),
    _set("eband", "eband_local_planner/EBandPlannerROS", 0.35, 0.9, own={
        "max_vel_lin": 0.35, "max_vel_th": 0.9, "max_acceleration": 0.6, "eband_min_relative_overlap": 0.7}),
    _set("mapping", DWA, 0.4, 1.2, localisation="gmapping"),
    _set("mapping in Stage", TRAJECTORY, 0.35, 1.0, **_STAGE, localisation="gmapping", own={"dwa": True}),
    _set("no map", DWA, 0.4, 1.2, localisation="ekf", costmaps="rolling"),
    _set("holonomic", TRAJECTORY, 0.4, 1.0, own={
        "holonomic_robot": True, "simple_attractor": False, "y_vels": "-0.1,0.1"}),
    _set("filtered", TRAJECTORY, 0.3, 0.9, laser="filtered", costmaps="rolling", commands="smoother", own={
        "sim_time": 1.0, "vx_samples": 12}),
    _set("adapter", "nav_core_adapter::LocalPlannerAdapter", 0.25, 0.8, own={
        "planner_name": "dwb_local_planner::DWBLocalPlanner"}, more={"DWBLocalPlanner": {
        **_TOLERANCES, "max_vel_x": 0.25, "max_speed_xy": 0.25, "max_vel_theta": 0.8, "acc_lim_x": 2.5,
        "acc_lim_theta": 3.2}}),
    _set("maker", "neo_local_planner/NeoLocalPlanner", 0.3, 0.8, own={
        "max_trans_vel": 0.3, "max_rot_vel": 0.8, "acc_lim_x": 1.0, "acc_lim_theta": 2.0}),
    _set("old names", DWA, 0.3, 0.8, own={"max_trans_vel": 0.3, "max_rot_vel": 0.8, "with_old_names": True}),
    _set("car", TEB, 0.3, 0.9, robot={"drive": "ackermann", "min_turning_radius": 0.4}, own={
        "max_vel_x": 0.3, "max_vel_theta": 0.9, "acc_lim_x": 0.8, "acc_lim_theta": 1.2,
        "min_turning_radius": 0.4}),
    _set("omnidirectional", TRAJECTORY, 0.4, 1.0, robot={"drive": "omni"}, own={
        "holonomic_robot": True, "y_vels": "-0.1,0.1"}),
    _set("foreign layer that sees", DWA, 0.4, 1.0, costmaps="layers",
         more={"type_of_layer": "FetchDepthLayer"}),
    _set("multiplexer in Stage", TEB, 0.4, 1.0, **_STAGE, commands="twist_mux", laser="heights", own={
        "max_vel_x": 0.4, "max_vel_theta": 1.0, "weight_kinematics_nh": 1000.0}),
)  # fmt: skip


def launch_file(each: RobotSet, folder: Path, seed: int) -> Path:
    """Write a launch file, and the world for stageros, to a folder."""
    (folder / "apartment.world").write_text(_WORLD.format(map=MAP.with_suffix(".pgm")))
    nodes = "\n".join(_nodes(each, folder, seed))
    file = folder / "robot.launch"
    file.write_text(
        f'<launch>\n<param name="/use_sim_time" value="true"/>\n'
        f'<rosparam param="/lockstep">{json.dumps(each.members)}</rosparam>\n{nodes}\n</launch>\n'
    )
    return file


_WORLD: Final = """\
define plan model ( boundary 0 )
plan ( name "walls" bitmap "{map}" size [10 8 1] pose [5 4 0 0] )
position
(
  name "robot" pose [2.9 1.0 0 68.755] size [0.3 0.3 0.2] drive "diff" odom_error [0.01 0.01 0 0.02]
  ranger ( pose [0 0 0.1 0] sensor ( range [0.0 10.0] fov 359.0 samples 360 ) )
)
"""


def _node(pkg: str, kind: str, name: str, given: Any = None, args: str = "", **remapped: str) -> str:
    """Return a node. In the names of `remapped`, `__` stands for a slash."""
    inside = "".join(f'<remap from="{old.replace("__", "/")}" to="{new}"/>' for old, new in remapped.items())
    if given:
        inside += f"<rosparam>{escape(json.dumps(given))}</rosparam>"
    return f'<node pkg="{pkg}" type="{kind}" name="{name}" args={quoteattr(args)}>{inside}</node>'


def _nodes(each: RobotSet, folder: Path, seed: int) -> Iterator[str]:
    kinds = {"twist_mux": "mux_out", "smoother": "smooth", "controllers": "base/cmd_vel"}
    to_robot = kinds.get(each.commands)
    scan = "base_scan" if each.simulator == "stageros" else "scan"
    has_filter = "kf" in each.localisation
    yield _robot(each, folder, seed, has_filter=has_filter, cmd_vel=to_robot)
    yield from _commands(each)
    if each.has_map:
        yield _node("map_server", "map_server", "map_server", args=str(MAP))
    if has_filter:
        kind = each.localisation[:3]
        values = {"frequency": 50, "two_d_mode": True, "odom0_config": _WHEELS, "imu0_config": _YAW,
                  "odom0": "base/odom" if each.commands == "controllers" else "odom", "imu0": "imu",
                  "imu0_differential": kind == "ekf", "world_frame": "odom"}  # fmt: skip
        yield _node("robot_localization", f"{kind}_localization_node", kind, values)
    frames = {"odom_frame_id": "odom", "base_frame_id": "base_link"}
    if "amcl" in each.localisation:
        place = dict(zip(("initial_pose_x", "initial_pose_y", "initial_pose_a"), START, strict=True))
        yield _node("amcl", "amcl", "amcl", {**frames, **place, "seed": seed}, scan=scan)
    elif each.localisation == "fake":
        yield _node("fake_localization", "fake_localization", "fake_localization", frames)
    elif each.localisation == "gmapping":
        values = {"base_frame": "base_link", "odom_frame": "odom", "map_update_interval": 2.0,
                  "particles": 10, "linearUpdate": 0.3,
                  "xmin": -8, "ymin": -8, "xmax": 10, "ymax": 10}  # fmt: skip
        yield _node("gmapping", "slam_gmapping", "slam_gmapping", values, scan=scan)
    if each.laser in ("filtered", "cloud"):
        target = "cloud" if each.laser == "cloud" else "scan"
        key = "cloud_filter_chain" if each.laser == "cloud" else "scan_filter_chain"
        near = {"name": "near", "type": "laser_filters/LaserScanRangeFilter",
                "params": {"lower_threshold": 0.15, "upper_threshold": 8.0}}  # fmt: skip
        values = {
            "scan_filter_chain": [near], key: [near] if key[0] == "s" else [], "target_frame": "base_link"
        }  # fmt: skip
        remapped = {"scan": scan, f"{target}_filtered": "seen"}
        yield _node("laser_filters", f"scan_to_{target}_filter_chain", "laser_filter", values, **remapped)
    odom = {"odom": "odometry/filtered"} if has_filter else {}
    yield _node("move_base", "move_base", "move_base", _move_base(each, scan), **odom)


def _robot(each: RobotSet, folder: Path, seed: int, *, has_filter: bool, cmd_vel: str | None) -> str:
    remapped = {"cmd_vel": cmd_vel} if cmd_vel and each.commands != "controllers" else {}
    if each.simulator == "stageros":
        return _node("stage_ros", "stageros", "sim", args=f"-g {folder / 'apartment.world'}", **remapped)
    x, y, yaw = START
    values = {
        "map": str(MAP), "seed": seed, "headless": True, "robots": [{"x": x, "y": y, "yaw": yaw}],
        "laser": {"z": 0.3}, "base_frame": "base_link", "publish_tf": not has_filter,
        "robot": {"odometry_noise": 0.02, "max_linear": 2.0, "max_angular": 5.0, **each.robot},
        "controllers": "/" if each.commands == "controllers" else "",
    }  # fmt: skip
    return _node("pipros_sim", "sim", "sim", values, **remapped)


def _commands(each: RobotSet) -> Iterator[str]:
    if each.commands in ("twist_mux", "controllers"):
        out = "base/cmd_vel" if each.commands == "controllers" else "mux_out"
        topics = [{"name": "joy", "topic": "joy_teleop/cmd_vel", "timeout": 0.5, "priority": 10},
                  {"name": "navigation", "topic": "cmd_vel", "timeout": 0.5, "priority": 1}]  # fmt: skip
        locks = [{"name": "stop", "topic": "e_stop", "timeout": 0.0, "priority": 255}]
        given = {"topics": topics, "locks": locks}
        yield _node("twist_mux", "twist_mux", "twist_mux", given, cmd_vel_out=out)
    if each.commands == "smoother":
        values = {"speed_lim_v": each.speed, "speed_lim_w": each.turn, "accel_lim_v": 1.0, "accel_lim_w": 3.0,
                  "frequency": 20.0, "decel_factor": 1.5}  # fmt: skip
        yield _node(
            "nodelet", "nodelet", "smoother", values,
            "standalone yocs_velocity_smoother/VelocitySmootherNodelet", smoother__raw_cmd_vel="cmd_vel",
            smoother__smooth_cmd_vel="smooth", smoother__odometry="odom", smoother__robot_cmd_vel="smooth",
        )  # fmt: skip
    if each.commands == "controllers":
        base = {"type": "diff_drive_controller/DiffDriveController", "left_wheel": "wheel_left_joint",
                "right_wheel": "wheel_right_joint", "publish_rate": 50, "cmd_vel_timeout": 0.5,
                "enable_odom_tf": False, "pose_covariance_diagonal": [0.001] * 6,
                "twist_covariance_diagonal": [0.001] * 6, "base_frame_id": "base_link"}  # fmt: skip
        yield f'<rosparam ns="base">{json.dumps(base)}</rosparam>'
        yield _node("controller_manager", "spawner", "spawner", args="base")


def _move_base(each: RobotSet, scan: str) -> dict[str, Any]:
    more = dict(each.more)
    world = "odom" if each.localisation == "ekf" else "map"
    topic = {"scan": scan, "heights": scan}.get(each.laser, "seen")
    heights = (0.25, 0.35) if each.laser == "heights" else (more.pop("min_obstacle_height", 0.0), 2.0)
    source = {
        "data_type": "PointCloud2" if each.laser == "cloud" else "LaserScan", "topic": topic, "marking": True,
        "clearing": True, "inf_is_valid": True, "min_obstacle_height": heights[0],
        "max_obstacle_height": heights[1],
    }  # fmt: skip
    sources = {"observation_sources": "laser", "laser": source}
    inflation = {"inflation_radius": 0.4, "cost_scaling_factor": 5.0}
    is_global_static = each.costmaps != "rolling"
    kind = more.pop("type_of_layer", "VoxelLayer" if each.laser == "heights" else "ObstacleLayer")
    kinds = {"obstacles": kind, "inflation": "InflationLayer"}
    layers = [{"name": name, "type": f"costmap_2d::{each}"} for name, each in kinds.items()]
    if more.pop("with_foreign_layer", False):
        layers.insert(0, {"name": "depth", "type": "costmap_2d::DepthCameraLayer"})
    usual = {
        "robot_base_frame": "base_link", "update_frequency": 5.0, "publish_frequency": 1.0,
        "transform_tolerance": 0.5, "resolution": 0.05,
    }  # fmt: skip
    local = {**usual, "global_frame": "odom", "rolling_window": True, "width": 4.0, "height": 4.0}
    whole = {
        **usual, "global_frame": world, "rolling_window": not is_global_static, "width": 16.0, "height": 16.0,
    }  # fmt: skip
    if each.costmaps == "layers" or each.laser == "heights":
        for costmap in (local, whole):
            costmap |= {"plugins": layers, "obstacles": sources, "inflation": inflation}
        whole["plugins"] = [{"name": "static", "type": "costmap_2d::StaticLayer"}, *layers]
    else:
        local |= {"static_map": False, **sources, **inflation}
        whole |= {"static_map": is_global_static, **sources, **inflation}
    namespace = re.split("[/:]", each.planner)[-1]
    return {
        "base_local_planner": each.planner, "base_global_planner": each.global_planner,
        "controller_frequency": 10.0, "planner_frequency": 1.0,
        "footprint": [[-0.14, -0.14], [-0.14, 0.14], [0.14, 0.14], [0.14, -0.14]],
        "local_costmap": local, "global_costmap": whole, namespace: dict(each.parameters), **more,
    }  # fmt: skip
