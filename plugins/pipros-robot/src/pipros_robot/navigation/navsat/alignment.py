"""The transform from geographic coordinates to the world frame of a filter.

The plane frame is the grid of a UTM zone, or east, north and up at the datum. The robot's first pose is known
in both frames: from a fix and an orientation, and from odometry. See section 3 of T. Moore and D. Stouch, A
Generalized Extended Kalman Filter Implementation for the Robot Operating System (2014).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pipros_libraries.transforms.pose import (
    IDENTITY,
    Pose,
    Vector,
    composed,
    from_roll_pitch_yaw,
    inverted,
    roll_pitch_yaw,
    rotate,
)
from pipros_robot.navigation.navsat.geodesy import LocalPlane, from_grid, to_grid


@dataclass(slots=True)
class Alignment:
    """Collects a fix, an odometry pose and an orientation, then computes the transform.

    Attributes:
        is_local: whether to use the local plane instead of the grid.
        turn: angle to add to the yaw of orientations (magnetic declination and offset), in radians.
        zone, is_north: zone and hemisphere of the grid.
        is_zone_fixed: whether a user has set the zone.
        start: position of the antenna in the plane at the first fix.
        odometry: pose of the robot in the world frame.
        attitude: orientation of the robot. A yaw of 0 is east.
        to_world: pose of the plane's frame in the world frame; None while unknown.
    """

    is_local: bool
    turn: float
    zone: int = 0
    is_north: bool = True
    is_zone_fixed: bool = False
    start: Vector | None = None
    odometry: Pose | None = None
    attitude: Pose | None = None
    to_world: Pose | None = None
    _plane: LocalPlane = field(default_factory=lambda: LocalPlane(0.0, 0.0))
    _convergence: float = 0.0

    def set_fix(self, latitude: float, longitude: float, altitude: float) -> None:
        """Use a fix as the start. Use its zone for all positions, unless a zone was set.

        Raises:
            OutOfRange: the fix has no coordinates in the zone.
        """
        if self.is_local:
            self._plane = LocalPlane(latitude, longitude)
            self.start = self._plane.forward(latitude, longitude, altitude)
            return
        fixed = self.is_zone_fixed
        grid = to_grid(latitude, longitude, self.zone if fixed else None, self.is_north if fixed else None)
        self.zone, self.is_north = grid.zone, grid.is_north
        self._convergence = math.radians(grid.convergence)
        self.start = grid.x, grid.y, altitude

    def set_zone(self, zone: int, is_north: bool) -> None:
        """Use a zone for all positions. The next fix is the start of a new transform."""
        self.zone, self.is_north, self.is_zone_fixed = zone, is_north, True
        self.start = self.to_world = None

    def set_attitude(self, orientation: Pose, mounting: Pose) -> None:
        """Use the orientation measured by a sensor that has the pose `mounting` on the robot.

        The mounting's angles are subtracted individually. Then roll and pitch are rotated by the mounting's
        yaw.
        """
        offsets = roll_pitch_yaw(mounting)
        roll, pitch, yaw = (
            math.remainder(angle - offset, math.tau)
            for angle, offset in zip(roll_pitch_yaw(orientation), offsets, strict=True)
        )
        turned = rotate((0.0, 0.0, 0.0, *from_roll_pitch_yaw(0.0, 0.0, offsets[2])), (roll, pitch, yaw))
        self.attitude = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(*turned))

    def align(self, antenna: Pose | None) -> bool:
        """Compute the transform. Return False if the start, the odometry or the orientation is unknown.

        Args:
            antenna: pose of the antenna on the robot; None if `start` is the robot's position.
        """
        if self.start is None or self.odometry is None or self.attitude is None:
            return False
        roll, pitch, yaw = roll_pitch_yaw(self.attitude)
        heading = yaw + self.turn + self._convergence
        x, y, z = self.start
        if antenna is not None:
            orientation: Pose = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(roll, pitch, heading))
            dx, dy, dz = rotate(orientation, antenna[:3])
            x, y, z = x - dx, y - dy, z - dz
        in_plane: Pose = (x, y, z, *from_roll_pitch_yaw(0.0, 0.0, heading))
        level = from_roll_pitch_yaw(0.0, 0.0, roll_pitch_yaw(self.odometry)[2])
        self.to_world = composed((*self.odometry[:3], *level), inverted(in_plane))
        return True

    def in_plane(self, latitude: float, longitude: float, altitude: float) -> Vector:
        """Return the coordinates of a position in the plane, with the altitude as z.

        Raises:
            OutOfRange: the position has no coordinates in this plane.
        """
        if self.is_local:
            return (*self._plane.forward(latitude, longitude, altitude)[:2], altitude)
        grid = to_grid(latitude, longitude, self.zone, self.is_north)
        return grid.x, grid.y, altitude

    def in_world(self, position: Vector) -> Vector:
        """Convert coordinates in the plane to the world frame. The transform must be known."""
        return composed(self._aligned(), (*position, *IDENTITY[3:]))[:3]

    def geographic(self, position: Vector) -> Vector:
        """Convert coordinates in the world frame to latitude, longitude and altitude.

        The transform must be known.

        Raises:
            OutOfRange: the coordinates are too large for any place on earth.
        """
        x, y, z = composed(inverted(self._aligned()), (*position, *IDENTITY[3:]))[:3]
        if self.is_local:
            return (*self._plane.reverse(x, y, 0.0)[:2], z)
        return (*from_grid(self.zone, self.is_north, x, y), z)

    def _aligned(self) -> Pose:
        if self.to_world is None:
            raise RuntimeError("the transform to the world frame is not known yet")
        return self.to_world
