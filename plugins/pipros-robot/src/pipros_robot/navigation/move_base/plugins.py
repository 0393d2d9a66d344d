"""Select implementations for the planners and recovery behaviours named in the parameters."""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from pipros.node import Node
from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters, is_number, read_parameters
from pipros_libraries.nodes.velocities import checked_number, least_turning_radius
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.dwa.dwa_node import DwaLocalPlanner
from pipros_robot.navigation.move_base.limit_names import flat, meaning, misunderstood
from pipros_robot.navigation.move_base.recovery import Behaviour, ClearCostmap, Rotate, Tools
from pipros_robot.navigation.move_base.settings import SETTINGS as MOVE_BASE
from pipros_robot.navigation.move_base.settings import MoveBaseSettings
from pipros_robot.navigation.navfn.navfn_node import NavfnPlanner
from pipros_robot.navigation.trajectory.trajectory_node import TrajectoryLocalPlanner

GLOBAL_PLANNER: Final = "navfn/NavfnROS"
LOCAL_PLANNERS: Final[dict[str, type[DwaLocalPlanner]]] = {
    "dwa_local_planner/DWAPlannerROS": DwaLocalPlanner,
    "base_local_planner/TrajectoryPlannerROS": TrajectoryLocalPlanner,
}
"""The local planners. The first replaces those in C++."""
BEHAVIOURS: Final[dict[str, Callable[[Tools, str], Behaviour]]] = {
    "clear_costmap_recovery/ClearCostmapRecovery": ClearCostmap,
    "rotate_recovery/RotateRecovery": Rotate,
}
_CLEAR, _ROTATE = BEHAVIOURS
_MISPLACED: Final = {
    "recovery_behaviour_enabled": "recovery_behavior_enabled",
    "neutral_cost": "GlobalPlanner/neutral_cost (which only global_planner/GlobalPlanner reads)",
    "lethal_cost": "GlobalPlanner/lethal_cost (which only global_planner/GlobalPlanner reads)",
}
_GLOBAL_NAMES: Final = ("allow_unknown", "default_tolerance", "visualize_potential")
_FACTOR: Final = 4.0
"""Side of the square in which `aggressive_reset` keeps obstacles, in circumscribed radii."""


def check_planner(
    name: str, known: Iterable[str], parameter: str, log: logging.Logger, *, is_strict: bool
) -> str:
    """Return the planner to use for a name. If pipros lacks it, warn, and return the first of `known`.

    Raises:
        InvalidParameter: the parameter names another planner, and `is_strict` is true.
    """
    ours, *others = known
    for each in (ours, *others):
        if name == each:
            return each
        if name.replace("::", "/") in (each, namespace_of(each)):
            log.warning("%s: [%s] is not the name of the plugin: write [%s]", parameter, name, each)
            return each
    text = f"{parameter}: [{name}] is a C++ plugin, which pipros cannot load"
    if is_strict:
        raise InvalidParameter(f"{text}, and strict is set. Set it to [{ours}]")
    log.warning("%s; [%s] runs instead, with the parameters ~%s/…", text, ours, ours.partition("/")[2])
    return ours


def warn_of_names(node: Node, log: logging.Logger) -> None:
    """Warn of parameters that have no effect, because their names or places are wrong."""
    given = read_parameters(node, "~")
    for wrong, right in _MISPLACED.items():
        if given.has(wrong):
            log.warning("~%s has no effect: the name is ~%s", wrong, right)
    own = {each.name for each in MOVE_BASE}
    local = namespace_of(given.text("base_local_planner", MoveBaseSettings().base_local_planner))
    for names, namespace in (
        (_GLOBAL_NAMES, namespace_of(given.text("base_global_planner", GLOBAL_PLANNER))),
        ([each.name for kind in LOCAL_PLANNERS.values() for each in kind.settings], local),
    ):
        if outside := sorted({*names} & given.values.keys() - own):
            text = "without effect, because the planner reads its parameters below ~%s: %s"
            log.warning(text, namespace, ", ".join(f"~{each}" for each in outside))


def global_planner(node: Node, log: logging.Logger, costmap: Costmap, name: str) -> NavfnPlanner:
    """Create navfn, with the topics and parameters of the planner that the parameter names.

    Parameters below `~NavfnROS` take precedence. If navfn replaces another planner, log what it takes over.
    """
    namespace = namespace_of(name)
    if namespace == "NavfnROS" or not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", namespace):
        return NavfnPlanner(node, log, costmap)
    given = read_parameters(node, f"~{namespace}").values
    known = {**given, **read_parameters(node, "~NavfnROS").values}
    taken: dict[str, Any] = {each: known[each] for each in _GLOBAL_NAMES if each in known}
    rows = ", ".join(f"{each} = {value}" for each, value in taken.items())
    left = ", ".join(sorted({*given} - {*taken}))
    text = "global planner [%s] instead of [%s]\n  taken over: %s\n  not taken over: %s"
    log.info(text, GLOBAL_PLANNER, name, rows or "none", left or "none")
    return NavfnPlanner(node, log, costmap, f"~{namespace}", PrivateParameters(taken, f"~{namespace}/"))


def local_planner(node: Node, log: logging.Logger, costmap: Costmap, name: str, ours: str) -> DwaLocalPlanner:
    """Create a local planner, and log which limits it takes from the parameters.

    Args:
        name: the planner that the parameter names.
        ours: the planner that runs, from `LOCAL_PLANNERS`.
    """
    kind = LOCAL_PLANNERS[ours]
    is_replaced = namespace_of(name) != namespace_of(ours)
    forget_written(node, kind, {} if is_replaced else {each.name: each.default for each in kind.settings})
    given = read_parameters(node, kind.namespace).values
    name = behind_adapter(node, name) if is_replaced else name
    known = {*kind.renamed, *(each.name for each in kind.settings)}
    taken, left = (
        take_over(node, name) if is_replaced else ({}, [each for each in given if each not in known])
    )
    is_limited = has_limits(node, kind.namespace, kind.renamed)
    made = kind(node, log, costmap)
    note_written(node, kind.namespace, given)
    forwards, backwards, turn = made.greatest()
    rows = [f"local planner [{ours}]"]
    if is_replaced:
        rows[0] += f" instead of [{name}]"
        rows += [f"  taken over: {old} -> {new}" for old, new in taken.items()]
        rows += [f"  not taken over: {', '.join(sorted(left)) or 'none'}"]
    rows.append(f"  at most {forwards:g} m/s forwards, {backwards:g} m/s backwards, {turn:g} rad/s")
    log.info("\n".join(rows))
    if suspect := misunderstood(left):
        text = "%s: limits may be missing, because these names are not understood: %s; set them below %s"
        log.warning(text, namespace_of(name), ", ".join(suspect), kind.namespace)
    own = read_parameters(node, f"~{namespace_of(name)}")
    if is_replaced and own.boolean("cmd_angle_instead_rotvel", False):
        text = "%s: commands are rates of turning: a base that expects angles of the steering turns wrongly"
        log.warning(text, "cmd_angle_instead_rotvel")
    if made.turning_radius:
        text = (
            "the robot is a car: its turns have a radius of at least %g m, and it keeps its yaw at the goal"
        )
        log.warning(text, made.turning_radius)
    for problem in made.too_coarse():
        log.warning("%s/%s", kind.namespace, problem)
    if not is_limited:
        text = "no limit is set below %s: %g m/s and %g rad/s are assumed; set max_vel_x and max_vel_theta"
        log.warning(text, kind.namespace, forwards, turn)
    return made


def _default_behaviours(values: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the list to use if the parameter is missing or invalid, with each behaviour's parameters."""
    rotate = [{"name": "rotate_recovery", "type": _ROTATE}] if values["clearing_rotation_allowed"] else []
    kept = values["conservative_reset_dist"], values["circumscribed_radius"] * _FACTOR
    one, two = (
        {"name": f"{name}_reset", "type": _CLEAR, "reset_distance": distance}
        for name, distance in zip(("conservative", "aggressive"), kept, strict=True)
    )
    return [one, *rotate, two, *rotate]


def behaviours(given: Any, values: Mapping[str, Any], tools: Tools, *, is_strict: bool) -> dict[int, Any]:
    """Create the recovery behaviours. Return pairs of name and behaviour, by index.

    Raises:
        InvalidParameter: a behaviour does not exist in pipros, and `is_strict` is true.
    """
    listed = _checked(given, tools.log, is_strict=is_strict)
    if listed is None:
        listed = _default_behaviours(values)
        for each in listed:
            if "reset_distance" in each:
                tools.node.params.set(f"~{each['name']}/reset_distance", each["reset_distance"])
    made = [(each["name"], BEHAVIOURS[_full(each["type"])](tools, each["name"])) for each in listed]
    return dict(enumerate(made))


def _full(name: str) -> str:
    """Return a type's name with its package as a prefix."""
    return next((full for full in BEHAVIOURS if name in (full, full.partition("/")[2])), name)


def _checked(given: Any, log: logging.Logger, *, is_strict: bool) -> list[dict[str, Any]] | None:
    """Return the listed behaviours that pipros provides, or None if the parameter is missing or invalid."""
    if given is None:
        return None
    problem = "" if isinstance(given, list) else f"it must be a list, got {given!r}"
    names: set[str] = set()
    found = []
    for each in given if not problem else ():
        if not isinstance(each, dict) or not {"name", "type"} <= each.keys():
            problem = f"each behaviour must have a name and a type, got {each!r}"
        elif each["name"] in names:
            problem = f"the name [{each['name']}] occurs twice"
        elif _full(str(each["type"])) in BEHAVIOURS:
            found.append(each)
        else:
            text = f"recovery_behaviors: [{each['type']}] is a C++ plugin, which pipros cannot load"
            if is_strict:
                raise InvalidParameter(f"{text}, and strict is set. Remove it")
            log.warning("%s: it is left out", text)
        if problem:
            break
        names.add(each["name"])
    if problem:
        log.error("recovery_behaviors: %s; the default behaviours are used", problem)
        return None
    return found


DWA: Final = "~DWAPlannerROS"
_DWB: Final = "dwb_local_planner::DWBLocalPlanner"
_WEIGHTS: Final = {"path_distance_bias": 32.0, "goal_distance_bias": 20.0, "occdist_scale": 0.02}
"""Set unless the user sets one of them: with defaults of DWA, costs outweigh the way, and robots stand."""
_GAINS: Final = (("x", 2.5), ("theta", 3.2))
_LIMITS: Final = ("max_vel_x", "max_vel_trans", "max_vel_theta")


def namespace_of(planner: str) -> str:
    """Return the namespace of a plugin: its name without package and C++ namespace, as in pluginlib."""
    return re.split("[/:]", planner)[-1]


def behind_adapter(node: Node, planner: str) -> str:
    """Return the planner that an adapter such as `nav_core_adapter::LocalPlannerAdapter` loads.

    Return other names unchanged.
    """
    namespace = namespace_of(planner)
    usual = _DWB if namespace == "LocalPlannerAdapter" else planner
    return read_parameters(node, f"~{namespace}").text("planner_name", usual)


def take_over(node: Node, planner: str) -> tuple[dict[str, str], list[str]]:
    """Set parameters of DWA, where they are not set, to those of the planner that it replaces.

    Return the names that were taken over, with the names for DWA and the values, and those that were not.

    Raises:
        InvalidParameter: a limit is no number, not finite, or a negative maximum.
    """
    namespace = namespace_of(planner)
    given = dict(flat(read_parameters(node, f"~{namespace}").values))
    before = read_parameters(node, DWA).values
    found: dict[str, Any] = {}
    taken: dict[str, str] = {}
    for path, value in given.items():
        section, _, old = path.rpartition("/")
        new = meaning(old)
        is_limit = new is not None and new.startswith(("max_", "min_", "acc_"))
        if new is None or new in before or (section and not is_limit):
            continue
        if is_limit:
            is_magnitude = not new.startswith("min_")
            value = checked_number(node, f"{namespace}/{path}", 0.0, 0.0 if is_magnitude else -math.inf)
            if old == "max_vel_x_backwards":
                value = -abs(value)
            if new in found:  # of two names for one limit, the stricter one counts
                value = (min if is_magnitude else max)(value, found[new])
        found[new] = value
        taken[path] = f"{new} = {value}"
    if "min_turning_radius" not in {**before, **found} and (radius := least_turning_radius(given)):
        found["min_turning_radius"] = radius
    frequency = read_parameters(node, "~").number("controller_frequency", 20.0)
    period_s = 1.0 / frequency if frequency > 0 else 0.05
    found |= _derived({**before, **found}, before, found, period_s)
    if not _WEIGHTS.keys() & before.keys():
        found |= _WEIGHTS
    for name, value in found.items():
        node.params.set(f"{DWA}/{name}", value)
    return taken, [name for name in given if name not in taken]


def _derived(
    known: Mapping[str, Any], before: Mapping[str, Any], found: Mapping[str, Any], period_s: float
) -> dict[str, Any]:
    """Return values that follow from the limits, so that none of DWA's defaults exceeds them.

    The least velocities can be reached from standstill in a period; otherwise, the robot would never start.
    """
    limits = {name: value for name, value in known.items() if is_number(value)}
    made: dict[str, Any] = {}
    if not found:
        return made
    sideways = limits.get("max_vel_y", 0.0)
    made["max_vel_y"], made["min_vel_y"] = sideways, limits.get("min_vel_y", -abs(sideways))
    fastest = max(limits.get("max_vel_x", 0.55), -limits.get("min_vel_x", 0.0), abs(sideways))
    fastest = min(fastest, limits.get("max_vel_trans", fastest))
    made["max_vel_trans"] = fastest
    if fastest < limits.get("max_vel_x", 0.55):
        made["max_vel_x"] = fastest
    speed_up, turn_up = (limits.get(f"acc_lim_{axis}", usual) * period_s for axis, usual in _GAINS)
    made["min_vel_trans"] = min(0.1, fastest / 4, 0.9 * speed_up)
    made["min_vel_theta"] = min(0.4, limits.get("max_vel_theta", 1.0) / 2, 0.9 * turn_up)
    return {name: value for name, value in made.items() if name not in before and known.get(name) != value}


def forget_written(node: Node, kind: type[DwaLocalPlanner], usual: Mapping[str, Any]) -> None:
    """Delete the parameters below a planner's namespace that an earlier start of the node wrote.

    They would count as the user's, and hide limits that have become lower in the launch files since. A value
    that the launch files may have set to the same number stays if it bounds more than the `usual` one.
    """
    values = read_parameters(node, kind.namespace).values
    renamed = {new for old, new in kind.renamed.items() if old in values}
    for name, value in read_parameters(node, _written(node, kind.namespace)).values.items():
        default = usual.get(name)
        is_bound = name.startswith(("max_", "acc_")) or name in ("min_vel_x", "min_vel_y")
        is_strict = is_bound and is_number(value) and is_number(default) and abs(value) < abs(default)
        if values.get(name) == value and (name in renamed or not is_strict):
            node.params.delete(f"{kind.namespace}/{name}")


def note_written(node: Node, namespace: str, given: Mapping[str, Any]) -> None:
    """Store the values that were written since only the parameters `given` were set."""
    values = read_parameters(node, namespace).values
    written = {name: value for name, value in values.items() if name not in given}
    node.params.set(_written(node, namespace), written)


def _written(node: Node, namespace: str) -> str:
    return f"/pipros/written_at_start{node.resolve(namespace)}"  # not among the parameters of the node


def has_limits(node: Node, namespace: str, renamed: Mapping[str, str]) -> bool:
    """Return whether a planner's parameters set any limit of speed, maybe under an old name."""
    given = read_parameters(node, namespace)
    return any(map(given.has, (*_LIMITS, *(old for old, new in renamed.items() if new in _LIMITS))))
