"""The settings of a filter node, read from its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any, Final

import numpy as np

from pipros.navigation.filter.control import Control
from pipros.navigation.filter.kalman import DEFAULT_COVARIANCE, DEFAULT_PROCESS_NOISE, ExtendedKalmanFilter
from pipros.navigation.filter.measurements import Input
from pipros.navigation.filter.state import POSE, SIZE, TWIST, Array
from pipros.navigation.filter.timeline import Timeline
from pipros.navigation.filter.unscented import UnscentedKalmanFilter
from pipros.navigation.parameters import InvalidParameter, Parameters

KINDS: Final = ("odom", "pose", "twist", "imu")
INPUTS: Final = 100
"""Maximum number of inputs of one kind."""


@dataclass(frozen=True, slots=True)
class Topic:
    """An input topic. `pose`, `twist` and `acceleration` say what to use of its messages.

    Attributes:
        kind: `odom`, `pose`, `twist` or `imu`.
        uses_child_frame: the pose is that of the message's `child_frame_id`.
    """

    kind: str
    name: str
    topic: str
    queue_size: int
    nodelay: bool
    uses_child_frame: bool
    pose: Input
    twist: Input
    acceleration: Input

    @property
    def is_used(self) -> bool:
        return any(selected.flags.any() for selected in (self.pose, self.twist, self.acceleration))


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a node, without those of the filter itself. Times are in seconds."""

    frequency: float
    map_frame: str
    odom_frame: str
    base_frame: str
    base_frame_output: str
    world_frame: str
    publishes_tf: bool
    inverts_tf: bool
    publishes_acceleration: bool
    publishes_corrections: bool
    tf_offset_s: float
    tf_timeout_s: float
    has_diagnostics: bool
    gravity: float
    resets_on_jump: bool
    is_disabled: bool
    in_plane: bool
    is_command_stamped: bool
    topics: tuple[Topic, ...]


def read_settings(parameters: Parameters, prefix: str) -> Settings:
    """Read the settings of the node. `prefix` is the tf prefix of its frames.

    Raises:
        InvalidParameter: the node cannot run with a parameter.
    """

    def frame(name: str, default: str) -> str:
        given = parameters.text(name, default).lstrip("/")
        return f"{prefix.strip('/')}/{given}" if prefix.strip("/") and given else given

    map_frame, odom_frame = frame("map_frame", "map"), frame("odom_frame", "odom")
    base = frame("base_link_frame", "base_link")
    output = frame("base_link_frame_output", parameters.text("base_link_frame", "base_link"))
    if len({map_frame, odom_frame, base}) < 3 or output in (map_frame, odom_frame):
        raise InvalidParameter(
            f"map_frame, odom_frame and base_link_frame must differ, got {map_frame}, {odom_frame}, {base}"
        )
    frequency = parameters.number("frequency", 30.0)
    if not 0 < frequency < inf:
        raise InvalidParameter(f"~frequency must be > 0, got {frequency}")
    return Settings(
        frequency=frequency,
        map_frame=map_frame,
        odom_frame=odom_frame,
        base_frame=base,
        base_frame_output=output,
        world_frame=frame("world_frame", parameters.text("odom_frame", "odom")),
        publishes_tf=parameters.boolean("publish_tf", True),
        inverts_tf=parameters.boolean("invert_tf", False),
        publishes_acceleration=parameters.boolean("publish_acceleration", False),
        publishes_corrections=parameters.boolean("permit_corrected_publication", False),
        tf_offset_s=parameters.number("transform_time_offset", 0.0),
        tf_timeout_s=parameters.number("transform_timeout", 0.0),
        has_diagnostics=parameters.boolean("print_diagnostics", True),
        gravity=parameters.number("gravitational_acceleration", 9.80665),
        resets_on_jump=parameters.boolean("reset_on_time_jump", False),
        is_disabled=parameters.boolean("disabled_at_startup", False),
        in_plane=parameters.boolean("two_d_mode", False),
        is_command_stamped=parameters.boolean("stamped_control", False),
        topics=tuple(_read_topics(parameters)),
    )


def make_timeline(parameters: Parameters, *, unscented: bool) -> Timeline:
    """Make the filter with its first estimate.

    Raises:
        InvalidParameter: a list has a wrong length or wrong elements.
    """
    frequency = parameters.number("frequency", 30.0)
    timeout_s = parameters.number("sensor_timeout", 1.0 / frequency)
    options: dict[str, Any] = {
        "process_noise": _square(parameters, "process_noise_covariance", DEFAULT_PROCESS_NOISE),
        "covariance": _square(parameters, "initial_estimate_covariance", DEFAULT_COVARIANCE),
        "state": np.array(parameters.numbers("initial_state", SIZE, [0.0] * SIZE)),
        "is_noise_dynamic": parameters.boolean("dynamic_process_noise_covariance", False),
    }
    if parameters.boolean("use_control", False):
        options["control"] = _read_control(parameters, timeout_s)
    kalman: ExtendedKalmanFilter
    if unscented:
        spread = {name: parameters.number(name, default) for name, default in _SPREAD.items()}
        kalman = UnscentedKalmanFilter(**spread, **options)
    else:
        kalman = ExtendedKalmanFilter(**options)
    smooths = parameters.boolean("smooth_lagged_data", False)
    return Timeline(
        kalman,
        sensor_timeout_s=timeout_s,
        history_s=abs(parameters.number("history_length", 0.0)) if smooths else None,
        predicts_always=parameters.boolean("predict_to_current_time", False),
    )


_SPREAD: Final = {"alpha": 0.001, "kappa": 0.0, "beta": 2.0}


def _square(parameters: Parameters, name: str, default: Array) -> Array:
    return np.array(parameters.numbers(name, SIZE * SIZE, default.ravel().tolist())).reshape(SIZE, SIZE)


def _read_control(parameters: Parameters, timeout_s: float) -> Control:
    limits = parameters.numbers("acceleration_limits", 6, [1.0] * 6)
    gains = parameters.numbers("acceleration_gains", 6, [1.0] * 6)
    return Control(
        flags=np.array(parameters.booleans("control_config", 6)),
        acceleration_limits=np.array(limits),
        acceleration_gains=np.array(gains),
        deceleration_limits=np.array(parameters.numbers("deceleration_limits", 6, limits)),
        deceleration_gains=np.array(parameters.numbers("deceleration_gains", 6, gains)),
        timeout_s=parameters.number("control_timeout", timeout_s),
    )


def _read_topics(parameters: Parameters) -> list[Topic]:
    found = []
    for kind in KINDS:
        for number in range(INPUTS):
            if not parameters.has(f"{kind}{number}"):
                break
            found.append(_read_topic(parameters, kind, f"{kind}{number}"))
    return found


def _read_topic(parameters: Parameters, kind: str, name: str) -> Topic:
    flags = np.array(parameters.booleans(f"{name}_config", SIZE))
    relative = parameters.boolean(f"{name}_relative", False)
    differential = parameters.boolean(f"{name}_differential", False)

    def part(suffix: str, indices: slice, threshold: str, **options: bool) -> Input:
        """Return the settings for a part of the variables; the others are not used."""
        selected = np.zeros(SIZE, bool)
        selected[indices] = flags[indices]
        return Input(f"{name}_{suffix}", selected, parameters.number(f"{name}_{threshold}", inf), **options)

    several = kind in ("odom", "imu")
    nothing = slice(0, 0)
    return Topic(
        kind=kind,
        name=name,
        topic=parameters.text(name, ""),
        queue_size=max(parameters.integer(f"{name}_queue_size", 1), 1),
        nodelay=parameters.boolean(f"{name}_nodelay", False),
        uses_child_frame=parameters.boolean(f"{name}_pose_use_child_frame", False),
        pose=part(
            "pose",
            {"twist": nothing, "imu": slice(3, 6)}.get(kind, POSE),
            "pose_rejection_threshold" if several else "rejection_threshold",
            is_differential=differential,
            is_relative=relative and not differential,
        ),
        twist=part(
            "twist",
            {"pose": nothing, "imu": slice(9, 12)}.get(kind, TWIST),
            "twist_rejection_threshold" if several else "rejection_threshold",
        ),
        acceleration=part(
            "acceleration",
            slice(12, 15) if kind == "imu" else nothing,
            "linear_acceleration_rejection_threshold",
            is_relative=relative,
            removes_gravity=parameters.boolean(f"{name}_remove_gravitational_acceleration", False),
        ),
    )
