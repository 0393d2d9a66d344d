"""The settings of a filter node, read from its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from math import inf
from typing import Any, Final

import numpy as np

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_robot.navigation.filter.kalman import (
    DEFAULT_COVARIANCE,
    DEFAULT_PROCESS_NOISE,
    Control,
    ExtendedKalmanFilter,
)
from pipros_robot.navigation.filter.measurements import InputSettings
from pipros_robot.navigation.filter.state import ACCELERATION, ANGLES, POSE, RATES, SIZE, TWIST, Array
from pipros_robot.navigation.filter.timeline import Timeline
from pipros_robot.navigation.filter.unscented import UnscentedKalmanFilter

KINDS: Final = ("odom", "pose", "twist", "imu")
INPUTS: Final = 100
"""Maximum number of inputs of one kind."""


@dataclass(frozen=True, slots=True)
class InputTopic:
    """An input topic. `pose`, `twist` and `acceleration` specify which data in its messages are used.

    Attributes:
        kind: `odom`, `pose`, `twist` or `imu`.
        uses_child_frame: whether poses describe the message's `child_frame_id`.
    """

    kind: str
    name: str
    topic: str
    queue_size: int
    nodelay: bool
    uses_child_frame: bool
    pose: InputSettings
    twist: InputSettings
    acceleration: InputSettings

    @property
    def is_used(self) -> bool:
        return any(selected.flags.any() for selected in (self.pose, self.twist, self.acceleration))


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """The node's parameters by their ROS names, except the filter's parameters. Times are in seconds."""

    frequency: float = 30.0
    map_frame: str = "map"
    odom_frame: str = "odom"
    base_link_frame: str = "base_link"
    base_link_frame_output: str = ""
    world_frame: str = ""
    publish_tf: bool = True
    invert_tf: bool = False
    publish_acceleration: bool = False
    permit_corrected_publication: bool = False
    transform_time_offset: float = 0.0
    transform_timeout: float = 0.0
    print_diagnostics: bool = True
    gravitational_acceleration: float = 9.80665
    reset_on_time_jump: bool = False
    disabled_at_startup: bool = False
    two_d_mode: bool = False
    stamped_control: bool = False
    topics: tuple[InputTopic, ...] = ()


def read_settings(parameters: PrivateParameters, prefix: str) -> FilterSettings:
    """Read the node's settings. `prefix` is the tf prefix of its frames.

    As in the genuine node, mistakes with which the filter can run are only added to `parameters.problems`.

    Raises:
        InvalidParameter: the frequency is invalid.
    """

    def frame(name: str, default: str) -> str:
        given = parameters.text(name, default).lstrip("/")
        return f"{prefix.strip('/')}/{given}" if prefix.strip("/") and given else given

    base, odom = parameters.text("base_link_frame", "base_link"), parameters.text("odom_frame", "odom")
    usual = {"map": "map", "odom": "odom", "base_link": "base_link", "world": odom}
    frames = {f"{name}_frame": frame(f"{name}_frame", default) for name, default in usual.items()}
    output = frame("base_link_frame_output", base)
    fixed = frames["map_frame"], frames["odom_frame"], frames["base_link_frame"]
    if len(set(fixed)) < 3 or output in fixed[:2]:
        names = "map_frame, odom_frame and base_link_frame (or base_link_frame_output)"
        parameters.problems.append(f"{names} must differ, got {', '.join(fixed)} ({output})")
    topics = tuple(_read_topics(parameters))
    settings = parameters.read(FilterSettings, **frames, base_link_frame_output=output, topics=topics)
    if not 0 < settings.frequency < inf:
        raise InvalidParameter(f"~frequency must be > 0 and finite, got {settings.frequency}")
    return settings


def make_timeline(parameters: PrivateParameters, *, unscented: bool) -> Timeline:
    """Create the filter with its initial estimate, and the timeline that applies measurements to it.

    If a list has the wrong length or invalid elements, this is added to `parameters.problems`, and the
    default is used.
    """
    frequency = parameters.number("frequency", 30.0)
    timeout_s = parameters.number("sensor_timeout", 1.0 / frequency)
    options: dict[str, Any] = {
        "process_noise": _square(parameters, "process_noise_covariance", DEFAULT_PROCESS_NOISE),
        "covariance": _square(parameters, "initial_estimate_covariance", DEFAULT_COVARIANCE),
        "state": np.array(_numbers(parameters, "initial_state", [0.0] * SIZE)),
        "is_noise_dynamic": parameters.boolean("dynamic_process_noise_covariance", False),
    }
    if parameters.boolean("use_control", False):
        options["control"] = _read_control(parameters, timeout_s)
    if unscented:
        spread = {"alpha": 0.001, "kappa": 0.0, "beta": 2.0}
        options |= {name: parameters.number(name, default, 1e9) for name, default in spread.items()}
        alpha, kappa = options["alpha"], options["kappa"]
        if not alpha**2 * (SIZE + kappa) > 0:
            rule = f"~alpha must not be 0, and ~kappa must be > {-SIZE}"
            raise InvalidParameter(f"{rule}, got {alpha} and {kappa}")
    kalman = (UnscentedKalmanFilter if unscented else ExtendedKalmanFilter)(**options)
    smooths = parameters.boolean("smooth_lagged_data", False)
    return Timeline(
        kalman,
        sensor_timeout_s=timeout_s,
        history_s=abs(parameters.number("history_length", 0.0)) if smooths else None,
        predicts_always=parameters.boolean("predict_to_current_time", False),
    )


def _square(parameters: PrivateParameters, name: str, default: Array) -> Array:
    return np.array(_numbers(parameters, name, default.ravel().tolist())).reshape(SIZE, SIZE)


def _numbers(parameters: PrivateParameters, name: str, default: Sequence[float]) -> Sequence[float]:
    try:
        return parameters.numbers(name, len(default), default)
    except InvalidParameter as error:
        parameters.problems.append(f"{error}; the default is used")
        return default


def _read_control(parameters: PrivateParameters, timeout_s: float) -> Control:
    def six(name: str, default: Any) -> Any:
        return np.array(_numbers(parameters, name, default))

    limits, gains = (six(f"acceleration_{name}", (1.0,) * 6) for name in ("limits", "gains"))
    slower = six("deceleration_limits", tuple(limits)), six("deceleration_gains", tuple(gains))
    flags, timeout_s = (
        parameters.flags("control_config", 6),
        parameters.number("control_timeout", timeout_s),
    )
    return Control(np.array(flags), limits, gains, *slower, timeout_s)


def _read_topics(parameters: PrivateParameters) -> list[InputTopic]:
    found = []
    for kind in KINDS:
        names = takewhile(parameters.has, (f"{kind}{number}" for number in range(INPUTS)))
        found += [_read_topic(parameters, kind, name) for name in names]
    return found


def _read_topic(parameters: PrivateParameters, kind: str, name: str) -> InputTopic:
    flags = np.array(parameters.flags(f"{name}_config", SIZE))
    relative = parameters.boolean(f"{name}_relative", False)
    differential = parameters.boolean(f"{name}_differential", False)

    def part(suffix: str, indices: slice, threshold: str, **options: bool) -> InputSettings:
        """Return the settings for some of the variables. Other variables are not used."""
        selected = np.zeros(SIZE, bool)
        selected[indices] = flags[indices]
        return InputSettings(
            f"{name}_{suffix}", selected, parameters.number(f"{name}_{threshold}", inf), **options
        )

    several, nothing = kind in ("odom", "imu"), slice(0, 0)
    pose, twist, acceleration = {
        "odom": (POSE, TWIST, nothing),
        "pose": (POSE, nothing, nothing),
        "twist": (nothing, TWIST, nothing),
        "imu": (ANGLES, RATES, ACCELERATION),
    }[kind]
    limits = [
        f"{part}_rejection_threshold" if several else "rejection_threshold" for part in ("pose", "twist")
    ]
    is_free = parameters.boolean(f"{name}_remove_gravitational_acceleration", False)
    pushes = {"is_relative": relative, "removes_gravity": is_free}
    moves = {"is_differential": differential, "is_relative": relative and not differential}
    return InputTopic(
        kind,
        name,
        topic=parameters.text(name, ""),
        queue_size=max(parameters.integer(f"{name}_queue_size", 1), 1),
        nodelay=parameters.boolean(f"{name}_nodelay", False),
        uses_child_frame=parameters.boolean(f"{name}_pose_use_child_frame", False),
        pose=part("pose", pose, limits[0], **moves),
        twist=part("twist", twist, limits[1]),
        acceleration=part("acceleration", acceleration, "linear_acceleration_rejection_threshold", **pushes),
    )
