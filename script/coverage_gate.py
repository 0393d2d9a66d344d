"""Compares the results of `script/coverage` with the gate for each pure package."""

from __future__ import annotations

import json
import sys
from fnmatch import fnmatch
from pathlib import Path

# Minimum percentage of covered lines and branches, slightly below the coverage when the gate was set.
GATES = {
    "basics/names.py": 98,
    "basics/limits.py": 98,
    "net/*_state.py": 98,
    "wire": 97,
    "safe": 97,
    "cmake": 94,
    "msg": 95,
    "packages": 94,
    "pictures": 94,
    "master/registry.py": 97,
    "master/params.py": 98,
    "launch/model.py": 99,
    "launch/read*.py": 96,
    "launch/scope.py": 99,
    "launch/substitute.py": 99,
    "launch/xml.py": 99,
    "launch/command.py": 96,
    "launch/placement.py": 98,
    "launch/param_types.py": 98,
    "fleet/access.py": 98,
    "fleet/directory.py": 98,
    "fleet/events.py": 97,
    "fleet/fleet_file.py": 98,
    "fleet/fleet_rules.py": 98,
    "fleet/frames.py": 97,
    "fleet/history_files.py": 95,
    "fleet/keys.py": 97,
    "fleet/members.py": 98,
    "fleet/messages.py": 98,
    "fleet/outbox.py": 97,
    "fleet/presence.py": 97,
    "graph/drawing": 97,
    "bridges/admission.py": 98,
    "bridges/outbox.py": 97,
    "bridges/rosbridge/authentication.py": 96,
    "bridges/rosbridge/filling.py": 96,
    "bridges/rosbridge/globs.py": 100,
    "bridges/rosbridge/plain_values.py": 96,
    "bridges/rosbridge/protocol.py": 97,
    "bridges/rosbridge/text_input.py": 97,
    "bridges/foxglove/catalog.py": 98,
    "bridges/foxglove/frames.py": 98,
    "bridges/foxglove/graph_changes.py": 98,
    "bridges/foxglove/parameters.py": 98,
    "bridges/foxglove/requests.py": 98,
    "bag/index.py": 95,
    "bag/lz4_frame.py": 92,
    "bag/chunk_messages.py": 95,
    "bag/contents.py": 95,
    "bag/reader.py": 97,
    "bag/records.py": 98,
    "bag/runs.py": 94,
    "bag/writer.py": 97,
    "health/*_checks.py": 97,
    "navigation/costmap/footprint.py": 98,
    "navigation/costmap/grid.py": 97,
    "navigation/costmap/inflation_layer.py": 95,
    "navigation/costmap/layered.py": 97,
    "navigation/costmap/observations.py": 96,
    "navigation/costmap/obstacle_layer.py": 96,
    "navigation/costmap/static_layer.py": 94,
    "navigation/navfn/plan.py": 95,
    "navigation/navfn/potential.py": 97,
    "navigation/velocities/cmd_vel_mux.py": 98,
    "libraries/actions": 97,
    "libraries/bonds/life.py": 98,
    "libraries/bonds/side.py": 98,
    "libraries/diagnostics": 96,
    "libraries/filters": 95,
    "libraries/maps": 96,
    "libraries/markers": 98,
    "libraries/robot_model": 97,
    "libraries/topic_tools": 97,
    "libraries/transforms": 97,
    "libraries/vision": 91,
    "perception/clouds/filters.py": 87,
    "perception/clouds/pcd.py": 96,
    "perception/clouds/segmentation.py": 96,
    "perception/drivers/rplidar/samples.py": 97,
    "perception/drivers/urg/scip.py": 97,
    "perception/imu/attitude.py": 97,
    "perception/imu/complementary.py": 97,
    "perception/imu/madgwick.py": 97,
    "perception/laser/assembler.py": 97,
    "perception/laser/cloud_to_scan.py": 98,
    "perception/laser/depth_to_scan.py": 97,
    "perception/laser/filters": 91,
    "perception/laser/projection.py": 90,
    "ros2/action_messages.py": 98,
    "ros2/action_pair.py": 97,
    "ros2/bags": 93,
    "ros2/conversion": 97,
    "ros2/counts.py": 98,
    "ros2/gateway_status.py": 98,
    "ros2/interfaces": 97,
    "ros2/names.py": 98,
    "ros2/qos_choice.py": 98,
    "ros2/ros2_graph.py": 98,
    "ros2/rtps/announcements.py": 98,
    "ros2/rtps/connections.py": 94,
    "ros2/rtps/decoding.py": 95,
    "ros2/rtps/domain.py": 98,
    "ros2/rtps/encoding.py": 93,
    "ros2/rtps/participant_core.py": 91,
    "ros2/rtps/graph_info.py": 96,
    "ros2/rtps/incomplete.py": 98,
    "ros2/rtps/nodes.py": 98,
    "ros2/rtps/outbox.py": 99,
    "ros2/rtps/parameters.py": 93,
    "ros2/rtps/participant.py": 95,
    "ros2/rtps/peers.py": 97,
    "ros2/rtps/presence.py": 98,
    "ros2/rtps/qos.py": 98,
    "ros2/rtps/reader.py": 94,
    "ros2/rtps/engine.py": 92,
    "ros2/rtps/engine_endpoints.py": 90,
    "ros2/rtps/service_styles.py": 98,
    "ros2/rtps/service_client.py": 90,
    "ros2/rtps/services.py": 90,
    "ros2/rtps/sockets.py": 90,
    "ros2/rtps/submessages.py": 98,
    "ros2/rtps/topics.py": 97,
    "ros2/rtps/writer.py": 93,
    "ros2/rules.py": 98,
    "ros2/type_pairs.py": 95,
    "ros2/zenoh/tokens.py": 97,
    "simulation/launch_sets/expected_robot.py": 95,
    "simulation/launch_sets/footprints.py": 85,
    "simulation/launch_sets/node_topics.py": 95,
    "simulation/robots/battery.py": 95,
    "simulation/robots/drive.py": 95,
    "simulation/robots/ray_casting.py": 95,
    "simulation/robots/robot.py": 95,
    "simulation/robots/settings.py": 95,
    "simulation/robots/simulation.py": 90,
    "simulation/robots/stage_file.py": 90,
    "simulation/robots/stage_walls.py": 90,
    "simulation/robots/world.py": 95,
    "simulation/turtlesim/picture.py": 95,
    "simulation/turtlesim/turtle.py": 96,
    "simulation/turtlesim/world.py": 98,
    "web/bags/curve.py": 90,
    "web/curve_samples.py": 96,
    "web/messages/picture.py": 98,
    "web/bags/open_bags.py": 98,
}
_ROOT = Path("src/pipros")


def main(report: str) -> int:
    files = json.loads(Path(report).read_text())["files"]
    # Of packages/PACKAGE/src/pipros/x.py, and of packages/PACKAGE/facades/x.py.
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
        print(
            "Too low:", *below, "Lines that were not run: script/coverage report", sep="\n", file=sys.stderr
        )
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
