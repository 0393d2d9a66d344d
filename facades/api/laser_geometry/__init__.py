"""Drop-in replacement for Noetic's laser_geometry, with numpy: conversion of laser scans to point clouds."""

from laser_geometry.laser_geometry import LaserProjection as LaserProjection
