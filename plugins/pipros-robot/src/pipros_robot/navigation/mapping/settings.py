"""The parameters of slam_gmapping."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import Final

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_robot.navigation.plane import MAPPED_CELLS

LONGEST_M: Final = 1000.0
"""Longer ranges are ignored, whatever maximum range the laser reports."""


_MOST: Final = {
    "particles": 10_000, "kernelSize": 100, "iterations": 1000, "lskip": 100_000,
    **dict.fromkeys(("srr", "srt", "str", "stt"), 1e9),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class MappingSettings:
    """The parameters by their ROS names. Lengths are in metres, angles in radians, times in seconds.

    NaN stands for a default that depends on the first scan or on another parameter.
    """

    throttle_scans: int = 1
    base_frame: str = "base_link"
    map_frame: str = "map"
    odom_frame: str = "odom"
    map_update_interval: float = 5.0
    transform_publish_period: float = 0.05
    tf_delay: float = float("nan")
    maxRange: float = float("nan")  # noqa: N815 (the name of the parameter)
    maxUrange: float = float("nan")  # noqa: N815
    sigma: float = 0.05
    kernelSize: int = 1  # noqa: N815
    lstep: float = 0.05
    astep: float = 0.05
    iterations: int = 5
    lsigma: float = 0.075
    ogain: float = 3.0
    lskip: int = 0
    minimumScore: float = 0.0  # noqa: N815
    srr: float = 0.1
    srt: float = 0.2
    str: float = 0.1
    stt: float = 0.2
    linearUpdate: float = 1.0  # noqa: N815
    angularUpdate: float = 0.5  # noqa: N815
    temporalUpdate: float = -1.0  # noqa: N815
    resampleThreshold: float = 0.5  # noqa: N815
    particles: int = 30
    xmin: float = -100.0
    ymin: float = -100.0
    xmax: float = 100.0
    ymax: float = 100.0
    delta: float = 0.05
    occ_thresh: float = 0.25
    seed: int = -1  # only in pipros: makes the random numbers repeatable

    def with_ranges(self, range_max: float) -> MappingSettings:
        """Return the settings for a laser with this maximum range."""
        longest = min(self.maxRange if isfinite(self.maxRange) else range_max - 0.01, LONGEST_M)
        usable = self.maxUrange if isfinite(self.maxUrange) else longest
        return replace(self, maxRange=longest, maxUrange=min(usable, LONGEST_M))


def read_settings(parameters: PrivateParameters) -> MappingSettings:
    """Read the node's parameters. Values of the wrong type are ignored.

    Raises:
        InvalidParameter: a parameter has an invalid value.
    """
    settings = parameters.read(MappingSettings)
    settings = replace(  # as in tf, of which the genuine node uses the first version
        settings,
        base_frame=settings.base_frame.lstrip("/"),
        map_frame=settings.map_frame.lstrip("/"),
        odom_frame=settings.odom_frame.lstrip("/"),
    )
    delay_s = parameters.number("tf_delay", settings.transform_publish_period, 1e9)
    settings = replace(settings, tf_delay=delay_s)
    for name in ("delta", "sigma", "lsigma", "ogain", "lstep", "astep", "particles", "throttle_scans"):
        if not 0 < getattr(settings, name) < float("inf"):
            raise InvalidParameter(f"~{name} must be > 0 and finite, got {getattr(settings, name)}")
    for name, most in _MOST.items():
        if not 0 <= getattr(settings, name) <= most:
            raise InvalidParameter(f"~{name} must be from 0 to {most:g}, got {getattr(settings, name)}")
    for low, high in (("xmin", "xmax"), ("ymin", "ymax")):
        ends = getattr(settings, low), getattr(settings, high)
        if not ends[1] - ends[0] >= settings.delta:
            raise InvalidParameter(
                f"~{low} must be at least a cell (~delta) below ~{high}, got {ends[0]} and {ends[1]}"
            )
    width, height = settings.xmax - settings.xmin, settings.ymax - settings.ymin
    if width * height / settings.delta**2 > MAPPED_CELLS:
        limits = f"~xmin to ~xmax, and ~ymin to ~ymax, must have at most {MAPPED_CELLS} cells of ~delta"
        raise InvalidParameter(f"{limits}, got {width:g} X {height:g} m, {settings.delta:g} m per cell")
    return settings
