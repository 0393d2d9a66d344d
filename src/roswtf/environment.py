"""Rules about the environment variables. Facade of `pipros.health.wtf.environment`."""

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
