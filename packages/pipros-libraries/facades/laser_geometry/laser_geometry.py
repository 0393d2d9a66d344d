"""`LaserProjection`, which converts laser scans to point clouds."""

from __future__ import annotations

from typing import Any

from sensor_msgs.msg import LaserScan, PointCloud2, PointField

from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.vision.extras import numpy as np

_star_names(__name__, "pc2=sensor_msgs.point_cloud2 rospy")


class LaserProjection:
    """Converter from laser scans to point clouds in the scanner's frame.

    The ray directions are cached for scans with the same geometry.
    """

    LASER_SCAN_INVALID = -1.0
    LASER_SCAN_MIN_RANGE = -2.0
    LASER_SCAN_MAX_RANGE = -3.0

    class ChannelOption:
        """Flags for the channels of a point in addition to x, y and z."""

        NONE = 0x00
        INTENSITY = 0x01  # `intensity`; omitted if the scan has no intensities
        INDEX = 0x02  # `index`: the index of the ray in the scan, an int32
        DISTANCE = 0x04  # `distances`: the range in metres
        TIMESTAMP = 0x08  # `stamps`: the time since the scan's timestamp, in seconds
        VIEWPOINT = 0x10  # `vp_x`, `vp_y`, `vp_z`: the position of the scanner, always zero
        DEFAULT = INTENSITY | INDEX

    def __init__(self) -> None:
        self._rays: tuple[Any, Any, Any] | None = None

    def projectLaser(
        self,
        scan_in: LaserScan,
        range_cutoff: float = -1.0,
        channel_options: int = ChannelOption.DEFAULT,
    ) -> PointCloud2:
        """Return the points with `range_min` <= range < limit as a point cloud with one row.

        Args:
            range_cutoff: the limit in metres, at most the scan's `range_max`; negative for `range_max`.
            channel_options: flags of `ChannelOption`, combined with `|`.

        Raises:
            IndexError: the scan has intensities, but too few for the points.
        """
        ranges = np.asarray(scan_in.ranges, dtype=np.float64)
        limit = scan_in.range_max if range_cutoff < 0 else min(range_cutoff, scan_in.range_max)
        kept = np.flatnonzero((ranges < limit) & (ranges >= scan_in.range_min))
        cosines, sines = self._directions(scan_in, len(ranges))
        distances = ranges[kept]
        columns = {"x": cosines[kept] * distances, "y": sines[kept] * distances, "z": np.zeros(len(kept))}
        columns |= self._channels(scan_in, channel_options, kept, distances)
        types = {name: "<i4" if name == "index" else "<f4" for name in columns}
        points = np.empty(len(kept), dtype=list(types.items()))
        for name, column in columns.items():
            points[name] = column
        fields = [
            PointField(name, 4 * place, PointField.INT32 if name == "index" else PointField.FLOAT32, 1)
            for place, name in enumerate(columns)
        ]
        return PointCloud2(
            header=scan_in.header,
            height=1,
            width=len(points),
            fields=fields,
            is_bigendian=False,
            point_step=points.itemsize,
            row_step=points.nbytes,
            data=points.tobytes(),
            is_dense=False,
        )

    def _channels(self, scan_in: LaserScan, options: int, kept: Any, distances: Any) -> dict[str, Any]:
        channels: dict[str, Any] = {}
        option = self.ChannelOption
        if options & option.INTENSITY and len(scan_in.intensities):
            channels["intensity"] = self._intensities(scan_in, kept)
        if options & option.INDEX:
            channels["index"] = kept
        if options & option.DISTANCE:
            channels["distances"] = distances
        if options & option.TIMESTAMP:
            channels["stamps"] = kept * scan_in.time_increment
        if options & option.VIEWPOINT:
            channels |= dict.fromkeys(("vp_x", "vp_y", "vp_z"), 0.0)
        return channels

    def _intensities(self, scan_in: LaserScan, kept: Any) -> Any:
        if len(kept) and kept[-1] >= len(scan_in.intensities):
            raise IndexError(
                f"a scan must have an intensity for each range, got {len(scan_in.intensities)} for "
                f"{len(scan_in.ranges)}"
            )
        return np.asarray(scan_in.intensities)[kept]

    def _directions(self, scan_in: LaserScan, count: int) -> tuple[Any, Any]:
        shape = (count, scan_in.angle_min, scan_in.angle_increment)
        if self._rays is None or self._rays[0] != shape:
            angles = scan_in.angle_min + np.arange(count) * scan_in.angle_increment
            self._rays = shape, np.cos(angles), np.sin(angles)
        return self._rays[1:]
