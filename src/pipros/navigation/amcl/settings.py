"""The parameters of amcl."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from math import inf, isfinite, isnan, pi
from typing import Any, Final

from pipros.libraries.reconfiguring.server import Setting
from pipros.navigation.parameters import InvalidParameter, Parameters

LASER_MODELS: Final = ("beam", "likelihood_field", "likelihood_field_prob")
ODOMETRY_MODELS: Final = ("diff", "omni", "diff-corrected", "omni-corrected")


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters, under their names. Lengths are in metres, angles in radians, times in seconds."""

    min_particles: int = 100
    max_particles: int = 5000
    kld_err: float = 0.01
    kld_z: float = 0.99
    update_min_d: float = 0.2
    update_min_a: float = pi / 6.0
    resample_interval: int = 2
    transform_tolerance: float = 0.1
    recovery_alpha_slow: float = 0.001
    recovery_alpha_fast: float = 0.1
    do_beamskip: bool = False
    beam_skip_distance: float = 0.5
    beam_skip_threshold: float = 0.3
    tf_broadcast: bool = True
    force_update_after_initialpose: bool = False
    force_update_after_set_map: bool = False
    gui_publish_rate: float = -1.0
    save_pose_rate: float = 0.5
    use_map_topic: bool = False
    first_map_only: bool = False
    laser_min_range: float = -1.0
    laser_max_range: float = -1.0
    laser_max_beams: int = 30
    laser_z_hit: float = 0.95
    laser_z_short: float = 0.1
    laser_z_max: float = 0.05
    laser_z_rand: float = 0.05
    laser_sigma_hit: float = 0.2
    laser_lambda_short: float = 0.1
    laser_likelihood_max_dist: float = 2.0
    laser_model_type: str = "likelihood_field"
    odom_model_type: str = "diff"
    odom_alpha1: float = 0.2
    odom_alpha2: float = 0.2
    odom_alpha3: float = 0.2
    odom_alpha4: float = 0.2
    odom_alpha5: float = 0.2
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    global_frame_id: str = "map"
    restore_defaults: bool = False
    beam_skip_error_threshold: float = 0.9
    selective_resampling: bool = False
    std_warn_level_x: float = 0.2
    std_warn_level_y: float = 0.2
    std_warn_level_yaw: float = 0.1
    seed: int = -1  # of pipros alone: makes the random numbers repeatable

    @property
    def alphas(self) -> tuple[float, float, float, float, float]:
        return self.odom_alpha1, self.odom_alpha2, self.odom_alpha3, self.odom_alpha4, self.odom_alpha5


_RANGES: Final[Mapping[str, tuple[float | None, float | None, str]]] = {
    "min_particles": (0, 1000, "Smallest number of particles."),
    "max_particles": (0, 10000, "Greatest number of particles."),
    "kld_err": (0, 1, "Greatest error between the true and the estimated distribution."),
    "kld_z": (0, 1, "Quantile of the normal distribution for the chance that the error is not exceeded."),
    "update_min_d": (0, 5, "Distance along an axis before the next update, in metres."),
    "update_min_a": (0, 2 * pi, "Turn before the next update, in radians."),
    "resample_interval": (0, 20, "Updates from one resampling to the next."),
    "transform_tolerance": (0, 2, "Time for which the transform is valid in advance, in seconds."),
    "recovery_alpha_slow": (0, 0.5, "Decay rate of the slow average of weights; 0 is off, try 0.001."),
    "recovery_alpha_fast": (0, 1, "Decay rate of the fast average of weights; 0 is off, try 0.1."),
    "do_beamskip": (None, None, "Leave out beams that fit only a few particles (likelihood_field_prob)."),
    "beam_skip_distance": (0, 2, "Greatest distance of a fitting beam from an obstacle, in metres."),
    "beam_skip_threshold": (0, 1, "Share of particles that a beam must fit."),
    "tf_broadcast": (None, None, "Publish the transform from the global to the odometry frame."),
    "force_update_after_initialpose": (None, None, "Update with the next scan after an initial pose."),
    "force_update_after_set_map": (None, None, "Update with the next scan after a map by set_map."),
    "gui_publish_rate": (-1, 100, "Without effect."),
    "save_pose_rate": (-1, 10, "Rate at which the pose is saved as parameters, in Hz; negative: never."),
    "use_map_topic": (None, None, "Subscribe to the map, rather than request it. Read at the start only."),
    "first_map_only": (None, None, "Ignore all maps after the first."),
    "laser_min_range": (-1, 1000, "Shortest range of the laser in metres; -1: that in the scans."),
    "laser_max_range": (-1, 1000, "Longest range of the laser in metres; -1: that in the scans."),
    "laser_max_beams": (0, 250, "Beams of a scan to use."),
    "laser_z_hit": (0, 1, "Weight of hits on obstacles of the map."),
    "laser_z_short": (0, 1, "Weight of readings that are too short (beam)."),
    "laser_z_max": (0, 1, "Weight of readings of the longest range (beam)."),
    "laser_z_rand": (0, 1, "Weight of random readings."),
    "laser_sigma_hit": (0, 10, "Standard deviation of hits, in metres."),
    "laser_lambda_short": (0, 10, "Decay rate of short readings, per metre (beam)."),
    "laser_likelihood_max_dist": (0, 20, "Greatest distance to an obstacle that counts, in metres."),
    "laser_model_type": (None, None, "Sensor model."),
    "odom_model_type": (None, None, "Motion model."),
    "odom_alpha1": (0, 10, "Noise of the rotation from the rotation."),
    "odom_alpha2": (0, 10, "Noise of the rotation from the translation."),
    "odom_alpha3": (0, 10, "Noise of the translation from the translation."),
    "odom_alpha4": (0, 10, "Noise of the translation from the rotation."),
    "odom_alpha5": (0, 10, "Noise sideways from the translation (omni)."),
    "odom_frame_id": (None, None, "Frame of the odometry."),
    "base_frame_id": (None, None, "Frame of the robot."),
    "global_frame_id": (None, None, "Frame of the map."),
    "restore_defaults": (None, None, "Return to the settings at the start."),
}
_RECONFIGURE_DEFAULTS: Final = {"recovery_alpha_slow": 0.0, "recovery_alpha_fast": 0.0}


def _constants(names: tuple[str, ...], purpose: str) -> str:
    """Return the edit method of a parameter with constants."""
    constants = [
        {
            "name": name.replace("-", "_") + ("" if name.endswith("_prob") else "_const"),
            "type": "str",
            "value": name,
            "srcline": 0,
            "srcfile": "AMCL.cfg",
            "description": f"Use the model {name}",
            "ctype": "std::string",
            "cconsttype": "const char * const",
        }
        for name in names
    ]
    return repr({"enum": constants, "enum_description": purpose})


_CONSTANTS: Final = {
    "laser_model_type": _constants(LASER_MODELS, "Sensor models"),
    "odom_model_type": _constants(ODOMETRY_MODELS, "Motion models"),
}


def changeable_settings() -> list[Setting]:
    """Return the settings for clients of dynamic_reconfigure, with its defaults and bounds."""
    usual = Settings()
    return [
        Setting(
            name,
            _RECONFIGURE_DEFAULTS.get(name, getattr(usual, name)),
            low,
            high,
            description=text,
            edit_method=_CONSTANTS.get(name, ""),
        )
        for name, (low, high, text) in _RANGES.items()
    ]


def read_settings(parameters: Parameters) -> Settings:
    """Read the parameters of the node; values of another type count as not set."""
    readers: dict[type, Any] = {
        bool: parameters.boolean,
        int: parameters.integer,
        float: parameters.number,
        str: parameters.text,
    }
    usual = Settings()
    read = {
        each.name: readers[type(getattr(usual, each.name))](each.name, getattr(usual, each.name))
        for each in fields(usual)
    }
    old = "beam_skip_error_threshold_"  # an older spelling
    read["beam_skip_error_threshold"] = parameters.number(old, read["beam_skip_error_threshold"])
    return checked(Settings(**read))


def checked(settings: Settings) -> Settings:
    """Return settings that the filter can run with: known models, frames without a slash.

    Raises:
        InvalidParameter: a number of particles is not positive, or a number is not finite.
    """
    for each in fields(settings):
        value = getattr(settings, each.name)
        if isinstance(value, float) and not isfinite(value):
            raise InvalidParameter(f"~{each.name} must be a finite number, got {value}")
    most = max(settings.max_particles, settings.min_particles)
    if most < 1 or settings.min_particles < 0:
        raise InvalidParameter(
            f"~max_particles must be >= 1 and ~min_particles >= 0, got {most} and {settings.min_particles}"
        )
    return replace(
        settings,
        max_particles=most,
        laser_model_type=_known(settings.laser_model_type, LASER_MODELS, "likelihood_field"),
        odom_model_type=_known(settings.odom_model_type, ODOMETRY_MODELS, "diff"),
        resample_interval=max(1, settings.resample_interval),
        odom_frame_id=settings.odom_frame_id.removeprefix("/"),
        base_frame_id=settings.base_frame_id.removeprefix("/"),
        global_frame_id=settings.global_frame_id.removeprefix("/"),
    )


def _known(value: str, models: tuple[str, ...], usual: str) -> str:
    return value if value in models else usual


@dataclass(frozen=True, slots=True)
class Belief:
    """A normal distribution of the pose: mean, covariance of x and y, and variance of the yaw."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    xx: float = 0.25
    yy: float = 0.25
    aa: float = (pi / 12.0) ** 2
    xy: float = 0.0


def read_belief(parameters: Parameters) -> tuple[Belief, list[str]]:
    """Return the initial pose in the parameters, and the names of those that are ignored: not a number."""
    names = {
        "x": "initial_pose_x", "y": "initial_pose_y", "yaw": "initial_pose_a",
        "xx": "initial_cov_xx", "yy": "initial_cov_yy", "aa": "initial_cov_aa",
    }  # fmt: skip
    usual, found, ignored = Belief(), {}, []
    for field, name in names.items():
        value = parameters.number(name, getattr(usual, field))
        if isnan(value) or abs(value) == inf:
            ignored.append(name)
        else:
            found[field] = value
    return Belief(**found), ignored
