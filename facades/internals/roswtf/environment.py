"""Rules about the environment variables. Facade of `pipros.health.wtf.environment`."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf.environment import (
    environment_errors,
    environment_warnings,
    invalid_url,
    is_executable,
    paths,
    pythonpath_check,
    ros_home_check,
    ros_log_dir_check,
    ros_master_uri_hostname,
    ros_root_check,
    ros_test_results_dir_check,
    rosconsole_config_file_check,
    wtf_check_environment,
)

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
