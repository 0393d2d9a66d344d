"""Drop-in replacement for Noetic's laser_geometry, with numpy: convert laser scans to point clouds."""

from laser_geometry.laser_geometry import LaserProjection as LaserProjection
