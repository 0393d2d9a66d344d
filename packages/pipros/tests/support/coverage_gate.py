"""Compares the results of `.ci/coverage` with the gate for each pure package."""

import json
import sys
from fnmatch import fnmatch
from pathlib import Path

# Minimum percentage of covered lines and branches, slightly below the coverage when the gate was set.
_GATES = """
100: pipros_bridges/rosbridge/globs.py
99: pipros_tools/launch/model.py pipros_tools/launch/scope.py pipros_tools/launch/substitute.py
  pipros_tools/launch/xml.py pipros_ros2/rtps/outbox.py
98: pipros/basics/names.py pipros/basics/limits.py pipros/net/*_state.py pipros/master/params.py
  pipros_tools/launch/placement.py pipros_tools/launch/param_types.py pipros_fleet/access.py
  pipros_fleet/directory.py pipros_fleet/fleet_file.py pipros_fleet/fleet_rules.py pipros_fleet/members.py
  pipros_fleet/messages.py pipros_bridges/admission.py pipros_bridges/foxglove/catalog.py
  pipros_bridges/foxglove/frames.py pipros_bridges/foxglove/graph_changes.py
  pipros_bridges/foxglove/parameters.py pipros_bridges/foxglove/requests.py pipros_tools/bag/records.py
  pipros_robot/navigation/costmap/footprint.py pipros_robot/navigation/velocities/cmd_vel_mux.py
  pipros_libraries/bonds/life.py pipros_libraries/bonds/side.py pipros_libraries/markers
  pipros_robot/perception/laser/cloud_to_scan.py pipros_ros2/action_messages.py pipros_ros2/counts.py
  pipros_ros2/gateway_status.py pipros_rosbag2/names.py pipros_ros2/qos_choice.py pipros_ros2/ros2_graph.py
  pipros_ros2/rtps/announcements.py pipros_ros2/rtps/domain.py pipros_ros2/rtps/incomplete.py
  pipros_ros2/rtps/nodes.py pipros_ros2/rtps/presence.py pipros_ros2/rtps/qos.py
  pipros_ros2/rtps/service_styles.py pipros_ros2/rtps/submessages.py pipros_ros2/rules.py
  pipros_simulation/turtlesim/world.py pipros_page/messages/picture.py pipros_page/bags/open_bags.py
97: pipros/wire pipros/safe pipros/master/registry.py pipros_fleet/events.py pipros_fleet/frames.py
  pipros_fleet/keys.py pipros_fleet/outbox.py pipros_fleet/presence.py pipros_tools/graph/drawing
  pipros_bridges/outbox.py pipros_bridges/rosbridge/protocol.py pipros_bridges/rosbridge/text_input.py
  pipros_tools/bag/reader.py pipros_tools/bag/writer.py pipros_tools/health/*_checks.py
  pipros_robot/navigation/costmap/grid.py pipros_robot/navigation/costmap/layered.py
  pipros_robot/navigation/navfn/potential.py pipros_libraries/actions pipros_libraries/robot_model
  pipros_libraries/topic_tools pipros_libraries/transforms
  pipros_robot/perception/drivers/rplidar/samples.py pipros_robot/perception/drivers/urg/scip.py
  pipros_robot/perception/imu/attitude.py pipros_robot/perception/imu/complementary.py
  pipros_robot/perception/imu/madgwick.py pipros_robot/perception/laser/assembler.py
  pipros_robot/perception/laser/depth_to_scan.py pipros_ros2/action_pair.py pipros_rosbag2/conversion
  pipros_rosbag2/interfaces pipros_ros2/rtps/peers.py pipros_ros2/rtps/topics.py pipros_ros2/zenoh/tokens.py
96: pipros_tools/launch/read*.py pipros_tools/launch/command.py pipros_bridges/rosbridge/authentication.py
  pipros_bridges/rosbridge/filling.py pipros_bridges/rosbridge/plain_values.py
  pipros_robot/navigation/costmap/observations.py pipros_robot/navigation/costmap/obstacle_layer.py
  pipros_libraries/diagnostics pipros_libraries/maps pipros_robot/perception/clouds/pcd.py
  pipros_robot/perception/clouds/segmentation.py pipros_ros2/rtps/graph_info.py
  pipros_simulation/turtlesim/turtle.py pipros_page/curve_samples.py
95: pipros/msg pipros_fleet/history_files.py pipros_tools/bag/index.py pipros_tools/bag/chunk_messages.py
  pipros_tools/bag/contents.py pipros_robot/navigation/costmap/inflation_layer.py
  pipros_robot/navigation/navfn/plan.py pipros_libraries/filters pipros_ros2/rtps/decoding.py
  pipros_ros2/rtps/participant.py pipros_ros2/type_pairs.py pipros_simulation/launch_sets/expected_robot.py
  pipros_simulation/launch_sets/node_topics.py pipros_simulation/robots/battery.py
  pipros_simulation/robots/drive.py pipros_simulation/robots/ray_casting.py
  pipros_simulation/robots/robot.py pipros_simulation/robots/settings.py pipros_simulation/robots/world.py
  pipros_simulation/turtlesim/picture.py
94: pipros_workspace/cmake pipros/packages pipros_libraries/pictures pipros_tools/bag/runs.py
  pipros_robot/navigation/costmap/static_layer.py pipros_ros2/rtps/connections.py pipros_ros2/rtps/reader.py
93: pipros_rosbag2/bags pipros_ros2/rtps/encoding.py pipros_ros2/rtps/parameters.py
  pipros_ros2/rtps/writer.py
92: pipros_tools/bag/lz4_frame.py pipros_ros2/rtps/engine.py
91: pipros_libraries/vision pipros_robot/perception/laser/filters pipros_ros2/rtps/delivery.py
  pipros_ros2/rtps/discovery.py pipros_ros2/rtps/participant_core.py
90: pipros_robot/perception/laser/projection.py pipros_ros2/rtps/engine_endpoints.py
  pipros_ros2/rtps/service_client.py pipros_ros2/rtps/services.py pipros_ros2/rtps/sockets.py
  pipros_simulation/robots/simulation.py pipros_simulation/robots/stage_file.py
  pipros_simulation/robots/stage_walls.py pipros_page/bags/curve.py
87: pipros_robot/perception/clouds/filters.py
85: pipros_simulation/launch_sets/footprints.py
"""
GATES = {
    name: int(gate)
    for line in _GATES.replace("\n  ", " ").splitlines()[1:]
    for gate, names in [line.split(": ")]
    for name in names.split()
}
_ROOT = Path("src")


def main(report: str) -> int:
    files = json.loads(Path(report).read_text())["files"]
    # Of packages/PACKAGE/src/x.py, plugins/PLUGIN/src/x.py, and of FOLDER/facades/x.py.
    all_files = {Path(*Path(file).parts[2:]): of["summary"] for file, of in files.items()}
    measured = {file: summary for file, summary in all_files.items() if file.is_relative_to(_ROOT)}
    facades = {file: summary for file, summary in all_files.items() if file not in measured}
    below: list[str] = []
    gated: set[Path] = set()
    for package, gate in GATES.items():
        inside = {file for file in measured if _is_in(file, package)}
        gated |= inside
        reached = _per_cent(measured, inside)
        line = f"{package:24} {reached:5.1f} %   gate {gate} %"
        print(line)
        below += [line] if reached < gate else []
    print(f"{'the rest of pipros':24} {_per_cent(measured, measured.keys() - gated):5.1f} %")
    print(f"{'facades':24} {_per_cent(facades, set(facades)):5.1f} %")
    if below:
        print("Too low:", *below, "Lines that were not run: .ci/coverage report", sep="\n", file=sys.stderr)
    return int(bool(below))


def _is_in(file: Path, package: str) -> bool:
    path = file.relative_to(_ROOT).as_posix()
    return fnmatch(path, package) or path.startswith(f"{package}/")


def _per_cent(measured: dict[Path, dict[str, int]], files: set[Path]) -> float:
    """Return the percentage of lines and branches that were executed; 0 for a package that has no files."""
    run = sum(measured[file]["covered_lines"] + measured[file]["covered_branches"] for file in files)
    of = sum(measured[file]["num_statements"] + measured[file]["num_branches"] for file in files)
    return 100 * run / of if of else 0.0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
