"""Rules that check the environment variables. Facade of `pipros.health.wtf.environment`."""

from __future__ import annotations

import os

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import environment as _rules
from pipros.health.wtf.environment import invalid_url, paths
from roswtf.context import WtfContext
from roswtf.rules import apply, of_context, of_contexts

__all__ = [
    "environment_errors",
    "environment_warnings",
    "invalid_url",
    "is_executable",
    "paths",
    "pythonpath_check",
    "ros_home_check",
    "ros_log_dir_check",
    "ros_master_uri_hostname",
    "ros_root_check",
    "ros_test_results_dir_check",
    "rosconsole_config_file_check",
    "wtf_check_environment",
]

_star_names(
    __name__,
    "roswtf.rules:error_rule genericpath:isdir genericpath:isfile os socket stat string sys "
    "urllib.parse:urlparse roswtf.rules:warning_rule",
)

pythonpath_check = of_context(_rules.pythonpath_check)
ros_home_check = of_context(_rules.ros_home_check)
ros_log_dir_check = of_context(_rules.ros_log_dir_check)
ros_master_uri_hostname = of_context(_rules.ros_master_uri_hostname)
ros_root_check = of_context(_rules.ros_root_check)
ros_test_results_dir_check = of_context(_rules.ros_test_results_dir_check)
rosconsole_config_file_check = of_context(_rules.rosconsole_config_file_check)

environment_errors = of_contexts(_rules.environment_errors)
environment_warnings = of_contexts(_rules.environment_warnings)


def is_executable(path: str) -> bool:
    """Return True for a file that the current user may execute."""
    return os.path.isfile(path) and os.access(path, os.X_OK)


def wtf_check_environment(ctx: WtfContext) -> None:
    """Apply all rules of this module."""
    apply(ctx, environment_warnings, environment_errors)
