"""Fixtures for tests with genuine ROS 1 on the other side."""

from tests.interop.fixtures import *  # noqa: F403
