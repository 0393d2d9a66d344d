"""What the limits in files of other local planners are called in DWA.

The names follow a pattern, such as `max_vel_x`, `v_max`, `max_linear_speed`, `acc_limit_theta` or `MAX_W`:
one bound, one quantity, and at most one axis. Names with any other word are not understood.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

_OTHERS: Final[Mapping[str, str]] = {
    **{name: name for name in (
        "xy_goal_tolerance", "yaw_goal_tolerance", "trans_stopped_vel", "theta_stopped_vel", "odom_topic",
        "sim_time", "min_vel_x", "vx_samples", "vy_samples", "min_turning_radius",
    )},
    "max_vel_x_backwards": "min_vel_x",
    "vtheta_samples": "vth_samples",
    "trans_stopped_velocity": "trans_stopped_vel",
    **dict.fromkeys(("max_turn_rate", "max_yaw_rate", "max_yawrate"), "max_vel_theta"),
    **dict.fromkeys(("rot_stopped_velocity", "rot_stopped_vel"), "theta_stopped_vel"),
}  # fmt: skip
_BOUNDS: Final = {
    **dict.fromkeys(
        ("max", "maximum", "lim", "limit", "desired", "target", "cruise", "nominal", "top"), "max"
    ),
    **dict.fromkeys(("min", "minimum"), "min"),
}
_AXES: Final = {
    **dict.fromkeys(("x", "lin", "linear", "v", "forward", "drive"), "x"),
    "y": "y",
    **dict.fromkeys(("xy", "trans", "translation", "translational"), "trans"),
    **dict.fromkeys(("theta", "th", "rot", "rotation", "rotational", "ang", "angular", "w", "yaw"), "theta"),
}
_SPEEDS: Final = {"vel", "velocity", "speed", "v", "w"}
_ACCELERATIONS: Final = {"acc", "accel", "acceleration"}
_ABBREVIATIONS: Final = {
    "vx": "vel x", "vy": "vel y", "wz": "vel theta", "vw": "vel theta", "vth": "vel theta",
    "vtheta": "vel theta", "vmax": "max v", "wmax": "max w", "vmin": "min v", "wmin": "min w",
    "omega": "vel theta", "spd": "speed", "rotvel": "vel rot", "transvel": "vel trans", "linvel": "vel lin",
    "angvel": "vel ang",
}  # fmt: skip
_MOTIONS: Final = {*_SPEEDS, "turn", "turning", "rate", "mps", "rads"} | {each for each in _AXES if each[2:]}
_OTHER_SUBJECTS: Final = re.compile(
    r"weight|acc|decel|jerk|tolerance|(\b|_)(min|use|stop|sampl|scal|gain|topic)"
)
_KNOWN: Final = {*_BOUNDS, *_AXES, *_SPEEDS, *_ACCELERATIONS, "cmd"}


def _words(name: str) -> set[str]:
    words = (each.lower() for each in re.findall("[A-Z]?[a-z]+|[A-Z]+|[0-9]+", name))
    return set(" ".join(_ABBREVIATIONS.get(each, each) for each in words).split())


def meaning(name: str) -> str | None:
    """Return DWA's name for a parameter of another planner, or None if it has another meaning."""
    if name in _OTHERS:
        return _OTHERS[name]
    words = _words(name)
    bounds = {_BOUNDS[each] for each in words & _BOUNDS.keys()}
    axes = {_AXES[each] for each in words & _AXES.keys()}
    if words - _KNOWN or len(bounds) != 1 or len(axes) > 1:
        return None
    bound, axis = bounds.pop(), axes.pop() if axes else "trans"
    if words & _ACCELERATIONS:
        return None if bound == "min" else f"acc_lim_{'x' if axis == 'trans' else axis}"
    if not words & {*_SPEEDS, "linear", "angular"}:
        return None
    return "min_vel_trans" if (bound, axis) == ("min", "x") else f"{bound}_vel_{axis}"


def misunderstood(names: Iterable[str]) -> list[str]:
    """Return the names that sound like limits of velocities, in alphabetical order."""
    return sorted(
        each
        for each in names
        if (_words(each) & _MOTIONS and re.search("max|lim", each.lower()))
        or re.search("(?<!le)(?<!tra)vel|speed", each.lower())  # but not level and travel
        if not _OTHER_SUBJECTS.search(each.lower())
    )


def flat(given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the paths and values of nested parameters.

    If `type` names one of the sections beside it, as in `robot: {type: unicycle, unicycle: {…}, car: {…}}`,
    the other sections are left out.
    """
    chosen = given.get("type")
    has_choice = isinstance(chosen, str) and isinstance(given.get(chosen), Mapping)
    for name, value in given.items():
        if not isinstance(value, Mapping):
            yield name, value
        elif not has_choice or name == chosen:
            yield from ((f"{name}/{path}", each) for path, each in flat(value))
