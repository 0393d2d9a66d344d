"""The parameters of amcl."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite, pi
from typing import Final

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters, read
from pipros_libraries.reconfiguring.declared import tunable

LASER_MODELS: Final = ("beam", "likelihood_field", "likelihood_field_prob")
MOST_PARTICLES: Final = 500_000
ODOMETRY_MODELS: Final = ("diff", "omni", "diff-corrected", "omni-corrected")


def _constants(names: tuple[str, ...], purpose: str) -> str:
    """Return the edit method (the enum) of a parameter whose values are constants."""
    usual = {"type": "str", "srcline": 0, "srcfile": "AMCL.cfg", "ctype": "std::string"}
    constants = [
        {
            "name": name.replace("-", "_") + ("" if name.endswith("_prob") else "_const"),
            "value": name,
            "description": f"Use the model {name}",
            "cconsttype": "const char * const",
            **usual,
        }
        for name in names
    ]
    return repr({"enum": constants, "enum_description": purpose})


_LASER: Final = _constants(LASER_MODELS, "Sensor models")
_ODOMETRY: Final = _constants(ODOMETRY_MODELS, "Motion models")


@dataclass(frozen=True, slots=True)
class AmclSettings:
    """The parameters by their ROS names. Lengths are in metres, angles in radians, times in seconds."""

    min_particles: int = tunable(100, "Smallest number of particles.", 0, 1000)
    max_particles: int = tunable(5000, "Greatest number of particles.", 0, 10000)
    kld_err: float = tunable(0.01, "Greatest error of the estimated distribution.", 0, 1)
    kld_z: float = tunable(0.99, "Quantile of the normal distribution for this error.", 0, 1)
    update_min_d: float = tunable(0.2, "Distance along an axis before the next update, in metres.", 0, 5)
    update_min_a: float = tunable(pi / 6.0, "Turn before the next update, in radians.", 0, 2 * pi)
    resample_interval: int = tunable(2, "Number of updates between resamplings.", 0, 20)
    transform_tolerance: float = tunable(0.1, "Time by which the transform is dated ahead, in seconds.", 0, 2)
    recovery_alpha_slow: float = tunable(
        0.001, "Decay of the slow average of weights; try 0.001.", 0, 0.5, offered=0.0
    )
    recovery_alpha_fast: float = tunable(
        0.1, "Decay of the fast average of weights; try 0.1.", 0, 1, offered=0.0
    )
    do_beamskip: bool = tunable(False, "Skip beams that fit few particles (likelihood_field_prob).")
    beam_skip_distance: float = tunable(0.5, "Distance of a fitting beam from an obstacle, in metres.", 0, 2)
    beam_skip_threshold: float = tunable(0.3, "Share of particles that a beam must fit.", 0, 1)
    tf_broadcast: bool = tunable(True, "Publish the transform from map to odometry.")
    force_update_after_initialpose: bool = tunable(False, "Update with the first scan after an initial pose.")
    force_update_after_set_map: bool = tunable(False, "Update with the first scan after set_map.")
    gui_publish_rate: float = tunable(-1.0, "Has no effect.", -1, 100)
    save_pose_rate: float = tunable(
        0.5, "Rate at which the pose is saved as parameters, in Hz; <= 0: only at shutdown.", -1, 10
    )
    use_map_topic: bool = tunable(False, "Subscribe to the map. Only read at startup.")
    first_map_only: bool = tunable(False, "Ignore all maps after the first.")
    laser_min_range: float = tunable(-1.0, "Minimum range in metres; -1: as in the scan.", -1, 1000)
    laser_max_range: float = tunable(-1.0, "Maximum range in metres; -1: as in the scan.", -1, 1000)
    laser_max_beams: int = tunable(30, "Number of beams used per scan.", 0, 250)
    laser_z_hit: float = tunable(0.95, "Weight of hits on obstacles of the map.", 0, 1)
    laser_z_short: float = tunable(0.1, "Weight of readings that are too short (beam).", 0, 1)
    laser_z_max: float = tunable(0.05, "Weight of readings of the longest range (beam).", 0, 1)
    laser_z_rand: float = tunable(0.05, "Weight of random readings.", 0, 1)
    laser_sigma_hit: float = tunable(0.2, "Standard deviation of hits, in metres.", 0, 10)
    laser_lambda_short: float = tunable(0.1, "Decay rate of short readings, per metre (beam).", 0, 10)
    laser_likelihood_max_dist: float = tunable(2.0, "Longest distance to an obstacle, in metres.", 0, 20)
    laser_model_type: str = tunable("likelihood_field", "Sensor model.", edit_method=_LASER)
    odom_model_type: str = tunable("diff", "Motion model.", edit_method=_ODOMETRY)
    odom_alpha1: float = tunable(0.2, "Noise in the rotation caused by rotation.", 0, 10)
    odom_alpha2: float = tunable(0.2, "Noise in the rotation caused by translation.", 0, 10)
    odom_alpha3: float = tunable(0.2, "Noise in the translation caused by translation.", 0, 10)
    odom_alpha4: float = tunable(0.2, "Noise in the translation caused by rotation.", 0, 10)
    odom_alpha5: float = tunable(0.2, "Sideways noise caused by translation (omni).", 0, 10)
    odom_frame_id: str = tunable("odom", "Frame of the odometry.")
    base_frame_id: str = tunable("base_link", "Frame of the robot.")
    global_frame_id: str = tunable("map", "Frame of the map.")
    restore_defaults: bool = tunable(False, "Return to the settings at startup.")
    beam_skip_error_threshold: float = 0.9
    selective_resampling: bool = False
    std_warn_level_x: float = 0.2
    std_warn_level_y: float = 0.2
    std_warn_level_yaw: float = 0.1
    seed: int = -1  # only in pipros: makes the random numbers repeatable

    @property
    def alphas(self) -> tuple[float, float, float, float, float]:
        return self.odom_alpha1, self.odom_alpha2, self.odom_alpha3, self.odom_alpha4, self.odom_alpha5


def read_settings(parameters: PrivateParameters) -> AmclSettings:
    """Read the node's parameters. Ignore values of the wrong type. Raises the same errors as `checked`."""
    settings = parameters.read(AmclSettings)
    old = "beam_skip_error_threshold_"  # an older spelling
    share = parameters.number(old, settings.beam_skip_error_threshold)
    return checked(replace(settings, beam_skip_error_threshold=share))


def checked(settings: AmclSettings) -> AmclSettings:
    """Return valid settings.

    Unknown models and some numbers that are too small are replaced, and leading slashes are removed from
    frame IDs.

    Raises:
        InvalidParameter: the limits of the number of particles are invalid.
    """
    most = max(settings.max_particles, settings.min_particles)
    if not 1 <= most <= MOST_PARTICLES or settings.min_particles < 0:
        raise InvalidParameter(
            f"~max_particles must be from 1 to {MOST_PARTICLES} and ~min_particles >= 0, "
            f"got {settings.max_particles} and {settings.min_particles}"
        )
    laser, odometry = settings.laser_model_type, settings.odom_model_type
    return replace(
        settings,
        max_particles=most,
        laser_model_type=laser if laser in LASER_MODELS else "likelihood_field",
        odom_model_type=odometry if odometry in ODOMETRY_MODELS else "diff",
        resample_interval=max(1, settings.resample_interval),
        odom_frame_id=settings.odom_frame_id.removeprefix("/"),
        base_frame_id=settings.base_frame_id.removeprefix("/"),
        global_frame_id=settings.global_frame_id.removeprefix("/"),
    )


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


def read_belief(parameters: PrivateParameters) -> tuple[Belief, list[str]]:
    """Return the initial pose in the parameters, and the names of parameters that are not finite.

    Parameters that are not finite are ignored.
    """
    names = {"x": "pose_x", "y": "pose_y", "yaw": "pose_a", "xx": "cov_xx", "yy": "cov_yy", "aa": "cov_aa"}
    usual = Belief()
    given = parameters.values
    found = {each: read(given.get(f"initial_{name}"), getattr(usual, each)) for each, name in names.items()}
    ignored = [each for each, value in found.items() if not isfinite(value)]
    kept = {each: value for each, value in found.items() if each not in ignored}
    return Belief(**kept), [f"initial_{names[each]}" for each in ignored]
