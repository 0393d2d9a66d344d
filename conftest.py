"""Fixtures and hooks for all tests; see `tests.support.project_conftest`."""

from tests.support.project_conftest import *  # noqa: F403
