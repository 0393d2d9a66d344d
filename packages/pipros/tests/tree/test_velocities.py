"""Every shipped program that commands a base does so through `VelocityOutput`."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from pipros_libraries.nodes.velocities import VELOCITIES
from tests.support.environments import SHIPPED, files_below, import_path, source_files

CLASSES = {kind.partition("/")[2] for kind in VELOCITIES}
OTHERS = {
    "pipros_page/views/teleop.py": "asks a policy's gate for each velocity; see `VelocityCommands`",
    "pipros_robot/navigation/laser_matcher/laser_matcher_node.py": "publishes a measured velocity",
    "pipros_robot/navigation/world.py": "tests of navigation script the commands of the world's robot",
}
TURTLES = "pipros/share/turtle_"
"""Packages of courses, written with rospy as in genuine ROS. A turtle stops a second after a command."""


RELAYS = {
    "pipros_bridges/foxglove/publishing.py": "stops", "pipros_bridges/rosbridge/shared_publisher.py": "stops",
    "pipros_server/act_gate.py": "stops", "pipros_assistants/tools/acts.py": "through the gate",
    "pipros_page/views/calls.py": "through the gate",
    "pipros_data/live/commands.py": "publishes the stop of each topic at its end, and after 0.5 s of silence",
    "pipros_server/guardian_process.py": "publishes the stops of a policy",
    "pipros_tools/bag/player.py": "genuine: a zero would be in no recording, and appear in the next one",
    "pipros_tools/cli/rostopic/pub.py": "genuine: it sends what its arguments say, and nothing else",
    "pipros_fleet/sinks.py": "a zero would follow each hand-over to another member; bases have timeouts",
    "rostopic/publishing.py": "genuine: it sends what its arguments say, and nothing else",
    "topic_tools/nodes/output.py": "genuine: what follows a velocity is not known; bases have timeouts",
    "pipros_ros2/topic_to_ros1.py": "a ROS 2 publisher may be replaced by another one; bases have timeouts",
}  # fmt: skip
"""Programs that publish types known at run time only, and why a velocity does not outlive its source."""
NO_RELAYS = {
    "actionlib/action_client.py": "types of actions", "actionlib/action_server.py": "types of actions",
    "pipros/node/endpoints.py": "called with types", "topic_tools/lazy_transport.py": "called with types",
    "topic_tools/nodes/computing.py": "results of expressions, of a type that the user names",
    "pipros_tools/health/reach_back.py": "publishes nothing",
    "pipros_libraries/actions/goal_server.py": "types of actions",
    "pipros_libraries/nodes/velocities.py": "the output itself",
    "pipros_libraries/nodes/wiring.py": "called with types",
    "pipros/node/topics_and_services.py": "called with types",
    "pipros_robot/perception/clouds/pcd_nodes.py": "clouds",
    "pipros_robot/perception/images/depth_nodelets.py": "images",
    "pipros_robot/perception/imu/nodes.py": "measurements",
    "pipros_ros2/action_to_ros2.py": "types of actions",
    "pipros_simulation/robots/robot_endpoints.py": "measurements of a simulated robot",
    "rospy/managers.py": "called with types", "rospy/topics.py": "called with types",
}  # fmt: skip
TYPE = re.compile(r"[a-z]\w+/[A-Z]\w+")


def is_velocity(part: ast.AST, names: set[str]) -> bool:
    """Return whether an expression contains the name of a type of velocities, or a name for one."""
    for each in ast.walk(part):
        if isinstance(each, ast.Constant) and each.value in VELOCITIES:
            return True
        if isinstance(each, ast.Name | ast.Attribute) and ast.unparse(each) in names:
            return True
    return False


def advertised(tree: ast.AST) -> Iterator[int]:
    """Yield the lines that advertise velocities other than with a `VelocityOutput`."""
    names = {
        alias.asname or alias.name
        for each in ast.walk(tree)
        if isinstance(each, ast.ImportFrom)
        for alias in each.names
        if alias.name in CLASSES
    }
    assignments = [each for each in ast.walk(tree) if isinstance(each, ast.Assign | ast.AnnAssign)]
    for each in assignments:
        targets = each.targets if isinstance(each, ast.Assign) else [each.target]
        for target in targets:
            for name, value in _pairs(target, each.value):
                if is_velocity(value, names) and not _makes_output(value):
                    names.add(ast.unparse(name))
    for each in ast.walk(tree):
        if isinstance(each, ast.Call):
            ways = {ast.unparse(part).rpartition(".")[2] for part in (each.func, *each.args)}
            given = [*each.args, *(word.value for word in each.keywords)]
            if ways & {"advertise", "Publisher"} and any(is_velocity(part, names) for part in given):
                yield each.lineno


def _pairs(target: ast.expr, value: ast.expr | None) -> list[tuple[ast.expr, ast.expr]]:
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        return list(zip(target.elts, value.elts, strict=False))
    return [] if value is None else [(target, value)]


def _makes_output(value: ast.AST) -> bool:
    return isinstance(value, ast.Call) and ast.unparse(value.func) == "VelocityOutput"


def of_types_at_run_time(tree: ast.AST) -> bool:
    """Return whether a module advertises a topic whose type is written nowhere in the module."""
    names = {
        alias.asname or alias.name
        for each in ast.walk(tree)
        if isinstance(each, ast.ImportFrom) and (each.module or "").endswith(".msg")
        for alias in each.names
        if alias.name[0].isupper()  # types
    }

    def is_typed(part: ast.AST) -> bool:
        for each in ast.walk(part):
            if isinstance(each, ast.Constant) and isinstance(each.value, str) and TYPE.fullmatch(each.value):
                return True
            if isinstance(each, ast.Name | ast.Attribute) and ast.unparse(each) in names:
                return True
        return False

    for _ in range(3):  # names for names
        for each in ast.walk(tree):
            if isinstance(each, ast.Assign | ast.AnnAssign | ast.For | ast.comprehension):
                targets = each.targets if isinstance(each, ast.Assign) else [each.target]
                value = each.iter if isinstance(each, ast.For | ast.comprehension) else each.value
                if value is not None and is_typed(value):
                    parts = [one.elts if isinstance(one, ast.Tuple) else [one] for one in targets]
                    names |= {ast.unparse(one) for some in parts for one in some}
    calls = [each for each in ast.walk(tree) if isinstance(each, ast.Call)]
    return any(
        _advertises(each)
        and len(each.args) + len(each.keywords) > 1
        and not any(is_typed(part) for part in [*each.args, *(word.value for word in each.keywords)])
        for each in calls
    )


def programs() -> list[Path]:
    """Return all source files, and the shipped programs without a suffix."""
    shipped = [file for share in SHIPPED for file in files_below(share, "*") if not file.suffix]
    return source_files() + [file for file in shipped if file.read_bytes().startswith(b"#!")]


def _advertises(call: ast.Call) -> bool:
    """Return whether a call advertises with a node of ROS 1, its endpoints, a gate or rospy."""
    if ast.unparse(call.func) in ("rospy.Publisher", "Publisher"):
        return True
    for part in (call.func, *call.args):
        if isinstance(part, ast.Attribute) and part.attr == "advertise":
            holder = part.value
            name = holder.attr if isinstance(holder, ast.Attribute) else getattr(holder, "id", "")
            if name.lstrip("_") in ("node", "endpoints", "gate"):
                return True
    return isinstance(call.func, ast.Name) and call.func.id == "advertise"


def trees(files: list[Path]) -> Iterator[tuple[Path, ast.AST]]:
    """Yield the files that may publish, with their trees."""
    for file in files:
        if "advertise" in (text := file.read_text()) or "Publisher(" in text:
            yield file, ast.parse(text)


def test_velocities_leave_programs_only_through_their_output() -> None:
    found = {str(import_path(file)) for file, tree in trees(programs()) if list(advertised(tree))}
    assert sorted(each for each in found if not each.startswith(TURTLES)) == sorted(OTHERS)


def test_relays_stop_a_base_whose_source_has_gone_or_say_why_not() -> None:
    found = {
        str(import_path(file)): file for file, tree in trees(source_files()) if of_types_at_run_time(tree)
    }
    assert sorted(found) == sorted({**RELAYS, **NO_RELAYS})
    stopping = {name for name, file in found.items() if "RelayedVelocity(" in file.read_text()}
    assert stopping == {name for name, reason in RELAYS.items() if reason == "stops"}
