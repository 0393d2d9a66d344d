"""Fixtures for tests with peers on other implementations of DDS."""

from tests.support.dds_peers import peers

__all__ = ["peers"]
