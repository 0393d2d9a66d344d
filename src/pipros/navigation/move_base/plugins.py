"""Select implementations for the planners and recovery behaviours named in the parameters."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, Final

from pipros.navigation.move_base.recovery import Behaviour, ClearCostmap, Rotate, Tools
from pipros.navigation.parameters import InvalidParameter

GLOBAL_PLANNER: Final = "navfn/NavfnROS"
LOCAL_PLANNER: Final = "dwa_local_planner/DWAPlannerROS"
BEHAVIOURS: Final[dict[str, Callable[[Tools, str], Behaviour]]] = {
    "clear_costmap_recovery/ClearCostmapRecovery": ClearCostmap,
    "rotate_recovery/RotateRecovery": Rotate,
}
_CLEAR, _ROTATE = BEHAVIOURS
_FACTOR: Final = 4.0
"""Side of the square in which `aggressive_reset` keeps obstacles, in circumscribed radii."""


def check_planner(name: str, ours: str, parameter: str, log: logging.Logger, *, is_strict: bool) -> None:
    """Warn if a parameter names a planner other than `ours`, the only one of its kind in pipros.

    Raises:
        InvalidParameter: the parameter names another planner, and `is_strict` is true.
    """
    if name == ours:
        return
    if name == ours.partition("/")[2]:
        log.warning("%s: the name of [%s] lacks its package: write [%s]", parameter, name, ours)
        return
    text = f"{parameter}: [{name}] is a C++ plugin, which pipros cannot load"
    if is_strict:
        raise InvalidParameter(f"{text}, and strict is set. Set it to [{ours}]")
    log.warning("%s; [%s] runs instead, with the parameters ~%s/…", text, ours, ours.partition("/")[2])


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
