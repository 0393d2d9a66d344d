"""Fixtures for the page in a real browser."""

from tests.browser.chromium import *  # noqa: F403
