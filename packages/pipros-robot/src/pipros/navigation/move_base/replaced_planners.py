"""Limits and tolerances of local planners in C++, for DWA, which runs instead of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from pipros.libraries.nodes.params import is_number, read_parameters
from pipros.node import Node

DWA: Final = "~DWAPlannerROS"
_SAME: Final = dict.fromkeys(
    ("max_vel_x", "max_vel_y", "max_vel_trans", "max_vel_theta", "acc_lim_x", "acc_lim_y", "acc_lim_theta",
     "xy_goal_tolerance", "yaw_goal_tolerance", "trans_stopped_vel", "theta_stopped_vel", "odom_topic")
)  # fmt: skip
_SAME_NAMES: Final = {name: name for name in _SAME}
_NAMES: Final[Mapping[str, Mapping[str, str]]] = {
    "TebLocalPlannerROS": {**_SAME_NAMES, "max_vel_x_backwards": "min_vel_x"},
    "DWBLocalPlanner": {
        **_SAME_NAMES, "min_vel_x": "min_vel_x", "min_vel_y": "min_vel_y", "max_speed_xy": "max_vel_trans",
        "min_speed_xy": "min_vel_trans", "min_speed_theta": "min_vel_theta", "sim_time": "sim_time",
        "trans_stopped_velocity": "trans_stopped_vel", "rot_stopped_velocity": "theta_stopped_vel",
        "vx_samples": "vx_samples", "vy_samples": "vy_samples", "vtheta_samples": "vth_samples",
    },
    "EBandPlannerROS": {
        **_SAME_NAMES, "max_vel_lin": "max_vel_x", "max_vel_th": "max_vel_theta",
        "min_vel_lin": "min_vel_trans", "min_vel_th": "min_vel_theta", "max_acceleration": "acc_lim_x",
        "max_translational_acceleration": "acc_lim_x", "max_rotational_acceleration": "acc_lim_theta",
        "rot_stopped_vel": "theta_stopped_vel",
    },
}  # fmt: skip
"""Names below the namespace of each planner, with the names for DWA that have the same meaning."""
_WEIGHTS: Final = {"path_distance_bias": 32.0, "goal_distance_bias": 20.0, "occdist_scale": 0.02}
"""Set unless the user sets one of them: with defaults of DWA, costs outweigh the way, and robots stand."""
_GAINS: Final = (("x", 2.5), ("theta", 3.2))
_LIMITS: Final = ("max_vel_x", "max_vel_trans", "max_vel_theta")


def take_over(node: Node, planner: str) -> tuple[dict[str, str], list[str]]:
    """Set parameters of DWA, where they are not set, to those of the planner that it replaces.

    Return the names that were taken over, with the names for DWA and the values, and those that were not.
    """
    namespace = planner.rpartition("/")[2]
    given, names = read_parameters(node, f"~{namespace}").values, _NAMES.get(namespace, _SAME_NAMES)
    before = read_parameters(node, DWA).values
    found: dict[str, Any] = {}
    taken: dict[str, str] = {}
    for old, value in given.items():
        new = names.get(old)
        if new is None or new in before:
            continue
        if old == "max_vel_x_backwards" and is_number(value):
            value = -abs(value)
        found[new] = value
        taken[old] = f"{new} = {value}"
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


def forget_written(node: Node, namespace: str) -> None:
    """Delete the parameters below a planner's namespace that an earlier start of the node wrote.

    They would count as the user's, and hide limits that have become lower in the launch files since.
    """
    values = read_parameters(node, namespace).values
    for name, value in read_parameters(node, _written(node, namespace)).values.items():
        if values.get(name) == value:
            node.params.delete(f"{namespace}/{name}")


def note_written(node: Node, namespace: str, given: Mapping[str, Any]) -> None:
    """Store the values that were written since only the parameters `given` were set."""
    values = read_parameters(node, namespace).values
    written = {name: value for name, value in values.items() if name not in given}
    node.params.set(_written(node, namespace), written)


def _written(node: Node, namespace: str) -> str:
    return f"/pipros/written_at_start{node.resolve(namespace)}"  # not among the parameters of the node


def has_limits(node: Node, namespace: str) -> bool:
    """Return whether a planner's parameters set any limit of speed."""
    given = read_parameters(node, namespace)
    return any(map(given.has, (*_LIMITS, "max_rotational_vel")))
