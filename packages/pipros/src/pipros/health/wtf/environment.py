"""Rules about environment variables and the folders that they list."""

from __future__ import annotations

import os
from pathlib import Path

from pipros.basics.uri import split_uri
from pipros.health.wtf.rules import Problem, Rule, problems_of
from pipros.health.wtf.subject import Subject
from pipros.net.this_machine import addresses_of


def paths(path: str | None) -> list[str]:
    """Return the non-empty entries of a path variable."""
    return [entry for entry in (path or "").split(os.pathsep) if entry]


def invalid_url(url: str) -> str | None:
    """Return the problem with a master URI, or None if the URI is valid."""
    scheme, separator, rest = url.partition("://")
    if scheme != "http" or not separator:
        return "protocol is not 'http'"
    _, _, port = rest.partition("/")[0].rpartition(":")
    if ":" not in rest.partition("/")[0]:
        return "port number is missing"
    return None if port.isdecimal() else f"port number [{port}] is invalid"


def ros_root_check(subject: Subject) -> str | None:
    folder = subject.variables.get("ROS_ROOT")
    if folder and Path(folder).is_dir() and Path(folder).name != "ros":
        return f"ROS_ROOT [{folder}] must end in directory named 'ros'"
    return None


def pythonpath_check(subject: Subject) -> str | None:
    """Check whether several folders in PYTHONPATH contain rospy. Python imports it only from the first."""
    found = [
        entry
        for entry in paths(subject.variables.get("PYTHONPATH"))
        if Path(entry, "rospy", "__init__.py").is_file()
    ]
    if len(found) > 1:
        return f"several folders contain rospy ({', '.join(found)}); the first one is used"
    return None


def _writable(folder: Path, name: str) -> str | None:
    if folder.is_file():
        return f"{name} [{folder}] must point to a directory, not a file"
    if folder.is_dir() and not os.access(folder, os.W_OK):
        return f"{name} [{folder}] is not writable"
    return None


def ros_home_check(subject: Subject) -> str | None:
    return _writable(subject.environment.ros_home, "ROS_HOME")


def ros_log_dir_check(subject: Subject) -> str | None:
    return _writable(subject.environment.log_dir, "ROS_LOG_DIR")


def ros_test_results_dir_check(subject: Subject) -> str | None:
    return _writable(subject.environment.test_results_dir, "ROS_TEST_RESULTS_DIR")


def ros_master_uri_hostname(subject: Subject) -> str | None:
    try:
        host, _, _ = split_uri(subject.master_uri)
    except ValueError:
        return None  # another rule reports this
    return None if addresses_of(host) else f"Unknown host {host}"


def rosconsole_config_file_check(subject: Subject) -> bool:
    file = subject.variables.get("ROSCONSOLE_CONFIG_FILE")
    return bool(file) and not Path(str(file)).is_file()


def _no_folder(subject: Subject) -> bool:
    folder = subject.variables.get("ROS_ROOT")
    return bool(folder) and not Path(str(folder)).is_dir()


def _files(path: str | None) -> list[str]:
    return [entry for entry in paths(path) if Path(entry).is_file()]


def _no_folders(path: str | None) -> list[str]:
    return [entry for entry in paths(path) if not Path(entry).is_dir()]


environment_errors: list[Rule] = [
    (_no_folder, "ROS_ROOT [%(ros_root)s] does not point to a directory"),
    (ros_root_check, "ROS_ROOT is invalid: "),
    (
        lambda subject: _files(subject.variables.get("ROS_PACKAGE_PATH")),
        "Path(s) in ROS_PACKAGE_PATH [%(ros_package_path)s] points to a file instead of a directory: ",
    ),
    (
        lambda subject: _no_folders(subject.variables.get("ROS_PACKAGE_PATH")),
        "Not all paths in ROS_PACKAGE_PATH [%(ros_package_path)s] point to an existing directory: ",
    ),
    (
        lambda subject: [
            entry
            for entry in _no_folders(subject.variables.get("PYTHONPATH"))
            if not entry.endswith((".zip", ".egg"))
        ],
        "Not all paths in PYTHONPATH [%(pythonpath)s] point to a directory: ",
    ),
    (pythonpath_check, "PYTHONPATH [%(pythonpath)s] is invalid: "),
    (ros_home_check, "ROS_HOME is invalid: "),
    (ros_log_dir_check, "ROS_LOG_DIR is invalid: "),
    (ros_test_results_dir_check, "ROS_TEST_RESULTS_DIR is invalid: "),
    (
        lambda subject: invalid_url(subject.master_uri) if subject.master_uri else None,
        "ROS_MASTER_URI [%(ros_master_uri)s] is not a valid URL: ",
    ),
]

environment_warnings: list[Rule] = [
    (
        lambda subject: subject.variables.get("ROS_PACKAGE_PATH") is None,
        "ROS_PACKAGE_PATH is not set. This is not required, but is unusual",
    ),
    (
        lambda subject: subject.variables.get("ROS_PACKAGE_PATH") == "",
        "ROS_PACKAGE_PATH is empty. This is not required, but is unusual",
    ),
    (lambda subject: not subject.master_uri, "ROS_MASTER_URI is empty. This is not required, but is unusual"),
    (ros_master_uri_hostname, "Cannot resolve hostname in ROS_MASTER_URI [%(ros_master_uri)s]"),
    (rosconsole_config_file_check, "ROS_CONSOLE_CONFIG_FILE does not point to an existing file"),
]


def check_environment(subject: Subject) -> list[Problem]:
    """Apply all rules in this module."""
    return problems_of(subject, environment_warnings, environment_errors)
