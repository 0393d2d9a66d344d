"""Select implementations for the planners and recovery behaviours named in the parameters."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from pipros.libraries.nodes.params import InvalidParameter, read_parameters
from pipros.navigation.costmap.costmap import Costmap
from pipros.navigation.dwa.dwa_node import DwaLocalPlanner
from pipros.navigation.move_base.recovery import Behaviour, ClearCostmap, Rotate, Tools
from pipros.navigation.move_base.replaced_planners import (
    forget_written,
    has_limits,
    note_written,
    take_over,
)
from pipros.navigation.trajectory.trajectory_node import TrajectoryLocalPlanner
from pipros.node import Node

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
        if name == each.partition("/")[2]:
            log.warning("%s: the name of [%s] lacks its package: write [%s]", parameter, name, each)
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


def local_planner(node: Node, log: logging.Logger, costmap: Costmap, name: str, ours: str) -> DwaLocalPlanner:
    """Create a local planner, and log which limits it takes from the parameters.

    Args:
        name: the planner that the parameter names.
        ours: the planner that runs, from `LOCAL_PLANNERS`.
    """
    kind = LOCAL_PLANNERS[ours]
    forget_written(node, kind.namespace)
    given = read_parameters(node, kind.namespace).values
    is_replaced = name.rpartition("/")[2] != ours.rpartition("/")[2]
    taken, left = take_over(node, name) if is_replaced else ({}, [])
    is_limited = has_limits(node, kind.namespace)
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
