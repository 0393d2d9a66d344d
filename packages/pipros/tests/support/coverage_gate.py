"""Compares the results of `.ci/coverage` with the gate for each pure package."""

from __future__ import annotations

import json
import sys
from fnmatch import fnmatch
from pathlib import Path

# Minimum percentage of covered lines and branches, slightly below the coverage when the gate was set.
GATES = {
    "pipros/basics/names.py": 98,
    "pipros/basics/limits.py": 98,
    "pipros/net/*_state.py": 98,
    "pipros/wire": 97,
    "pipros/safe": 97,
    "pipros_workspace/cmake": 94,
    "pipros/msg": 95,
    "pipros/packages": 94,
    "pipros_libraries/pictures": 94,
    "pipros/master/registry.py": 97,
    "pipros/master/params.py": 98,
    "pipros_tools/launch/model.py": 99,
    "pipros_tools/launch/read*.py": 96,
    "pipros_tools/launch/scope.py": 99,
    "pipros_tools/launch/substitute.py": 99,
    "pipros_tools/launch/xml.py": 99,
    "pipros_tools/launch/command.py": 96,
    "pipros_tools/launch/placement.py": 98,
    "pipros_tools/launch/param_types.py": 98,
    "pipros_fleet/access.py": 98,
    "pipros_fleet/directory.py": 98,
    "pipros_fleet/events.py": 97,
    "pipros_fleet/fleet_file.py": 98,
    "pipros_fleet/fleet_rules.py": 98,
    "pipros_fleet/frames.py": 97,
    "pipros_fleet/history_files.py": 95,
    "pipros_fleet/keys.py": 97,
    "pipros_fleet/members.py": 98,
    "pipros_fleet/messages.py": 98,
    "pipros_fleet/outbox.py": 97,
    "pipros_fleet/presence.py": 97,
    "pipros_tools/graph/drawing": 97,
    "pipros_bridges/admission.py": 98,
    "pipros_bridges/outbox.py": 97,
    "pipros_bridges/rosbridge/authentication.py": 96,
    "pipros_bridges/rosbridge/filling.py": 96,
    "pipros_bridges/rosbridge/globs.py": 100,
    "pipros_bridges/rosbridge/plain_values.py": 96,
    "pipros_bridges/rosbridge/protocol.py": 97,
    "pipros_bridges/rosbridge/text_input.py": 97,
    "pipros_bridges/foxglove/catalog.py": 98,
    "pipros_bridges/foxglove/frames.py": 98,
    "pipros_bridges/foxglove/graph_changes.py": 98,
    "pipros_bridges/foxglove/parameters.py": 98,
    "pipros_bridges/foxglove/requests.py": 98,
    "pipros_tools/bag/index.py": 95,
    "pipros_tools/bag/lz4_frame.py": 92,
    "pipros_tools/bag/chunk_messages.py": 95,
    "pipros_tools/bag/contents.py": 95,
    "pipros_tools/bag/reader.py": 97,
    "pipros_tools/bag/records.py": 98,
    "pipros_tools/bag/runs.py": 94,
    "pipros_tools/bag/writer.py": 97,
    "pipros_tools/health/*_checks.py": 97,
    "pipros_robot/navigation/costmap/footprint.py": 98,
    "pipros_robot/navigation/costmap/grid.py": 97,
    "pipros_robot/navigation/costmap/inflation_layer.py": 95,
    "pipros_robot/navigation/costmap/layered.py": 97,
    "pipros_robot/navigation/costmap/observations.py": 96,
    "pipros_robot/navigation/costmap/obstacle_layer.py": 96,
    "pipros_robot/navigation/costmap/static_layer.py": 94,
    "pipros_robot/navigation/navfn/plan.py": 95,
    "pipros_robot/navigation/navfn/potential.py": 97,
    "pipros_robot/navigation/velocities/cmd_vel_mux.py": 98,
    "pipros_libraries/actions": 97,
    "pipros_libraries/bonds/life.py": 98,
    "pipros_libraries/bonds/side.py": 98,
    "pipros_libraries/diagnostics": 96,
    "pipros_libraries/filters": 95,
    "pipros_libraries/maps": 96,
    "pipros_libraries/markers": 98,
    "pipros_libraries/robot_model": 97,
    "pipros_libraries/topic_tools": 97,
    "pipros_libraries/transforms": 97,
    "pipros_libraries/vision": 91,
    "pipros_robot/perception/clouds/filters.py": 87,
    "pipros_robot/perception/clouds/pcd.py": 96,
    "pipros_robot/perception/clouds/segmentation.py": 96,
    "pipros_robot/perception/drivers/rplidar/samples.py": 97,
    "pipros_robot/perception/drivers/urg/scip.py": 97,
    "pipros_robot/perception/imu/attitude.py": 97,
    "pipros_robot/perception/imu/complementary.py": 97,
    "pipros_robot/perception/imu/madgwick.py": 97,
    "pipros_robot/perception/laser/assembler.py": 97,
    "pipros_robot/perception/laser/cloud_to_scan.py": 98,
    "pipros_robot/perception/laser/depth_to_scan.py": 97,
    "pipros_robot/perception/laser/filters": 91,
    "pipros_robot/perception/laser/projection.py": 90,
    "pipros_ros2/action_messages.py": 98,
    "pipros_ros2/action_pair.py": 97,
    "pipros_rosbag2/bags": 93,
    "pipros_rosbag2/conversion": 97,
    "pipros_ros2/counts.py": 98,
    "pipros_ros2/gateway_status.py": 98,
    "pipros_rosbag2/interfaces": 97,
    "pipros_rosbag2/names.py": 98,
    "pipros_ros2/qos_choice.py": 98,
    "pipros_ros2/ros2_graph.py": 98,
    "pipros_ros2/rtps/announcements.py": 98,
    "pipros_ros2/rtps/connections.py": 94,
    "pipros_ros2/rtps/decoding.py": 95,
    "pipros_ros2/rtps/delivery.py": 91,
    "pipros_ros2/rtps/discovery.py": 91,
    "pipros_ros2/rtps/domain.py": 98,
    "pipros_ros2/rtps/encoding.py": 93,
    "pipros_ros2/rtps/participant_core.py": 91,
    "pipros_ros2/rtps/graph_info.py": 96,
    "pipros_ros2/rtps/incomplete.py": 98,
    "pipros_ros2/rtps/nodes.py": 98,
    "pipros_ros2/rtps/outbox.py": 99,
    "pipros_ros2/rtps/parameters.py": 93,
    "pipros_ros2/rtps/participant.py": 95,
    "pipros_ros2/rtps/peers.py": 97,
    "pipros_ros2/rtps/presence.py": 98,
    "pipros_ros2/rtps/qos.py": 98,
    "pipros_ros2/rtps/reader.py": 94,
    "pipros_ros2/rtps/engine.py": 92,
    "pipros_ros2/rtps/engine_endpoints.py": 90,
    "pipros_ros2/rtps/service_styles.py": 98,
    "pipros_ros2/rtps/service_client.py": 90,
    "pipros_ros2/rtps/services.py": 90,
    "pipros_ros2/rtps/sockets.py": 90,
    "pipros_ros2/rtps/submessages.py": 98,
    "pipros_ros2/rtps/topics.py": 97,
    "pipros_ros2/rtps/writer.py": 93,
    "pipros_ros2/rules.py": 98,
    "pipros_ros2/type_pairs.py": 95,
    "pipros_ros2/zenoh/tokens.py": 97,
    "pipros_simulation/launch_sets/expected_robot.py": 95,
    "pipros_simulation/launch_sets/footprints.py": 85,
    "pipros_simulation/launch_sets/node_topics.py": 95,
    "pipros_simulation/robots/battery.py": 95,
    "pipros_simulation/robots/drive.py": 95,
    "pipros_simulation/robots/ray_casting.py": 95,
    "pipros_simulation/robots/robot.py": 95,
    "pipros_simulation/robots/settings.py": 95,
    "pipros_simulation/robots/simulation.py": 90,
    "pipros_simulation/robots/stage_file.py": 90,
    "pipros_simulation/robots/stage_walls.py": 90,
    "pipros_simulation/robots/world.py": 95,
    "pipros_simulation/turtlesim/picture.py": 95,
    "pipros_simulation/turtlesim/turtle.py": 96,
    "pipros_simulation/turtlesim/world.py": 98,
    "pipros_page/bags/curve.py": 90,
    "pipros_page/curve_samples.py": 96,
    "pipros_page/messages/picture.py": 98,
    "pipros_page/bags/open_bags.py": 98,
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
