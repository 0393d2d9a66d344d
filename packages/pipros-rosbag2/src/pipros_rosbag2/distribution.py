"""The supported ROS 2 distributions, and how they differ on the wire and in bags."""

from __future__ import annotations

from enum import Enum


class Distribution(Enum):
    """A ROS 2 distribution."""

    HUMBLE = "humble"
    JAZZY = "jazzy"
    KILTED = "kilted"
    LYRICAL = "lyrical"

    @property
    def has_type_hashes(self) -> bool:
        """Whether nodes exchange type hashes (since Iron)."""
        return self is not Distribution.HUMBLE

    @property
    def gid_bytes(self) -> int:
        """Size of `rmw_dds_common/msg/Gid`. A sample of the wrong size can crash Humble nodes."""
        return 24 if self is Distribution.HUMBLE else 16

    @property
    def bag_version(self) -> int:
        """Version of a bag's `metadata.yaml`.

        Humble cannot read the QoS profiles of version 9 (ros2/rosbag2#2013).
        """
        return 5 if self is Distribution.HUMBLE else 9
