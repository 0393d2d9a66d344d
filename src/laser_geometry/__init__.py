"""laser_geometry, as Noetic has it, on numpy: scans of lasers as clouds of points."""

from laser_geometry.laser_geometry import LaserProjection as LaserProjection
