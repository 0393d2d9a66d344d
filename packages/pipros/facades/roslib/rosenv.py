"""`roslib.rosenv`, for legacy scripts: the values of the `ROS_*` variables."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipros.basics.env import Environment
from pipros.node.program_log import make_folders_as_parent
from rosgraph.rosenv import ROS_HOSTNAME as ROS_HOSTNAME
from rosgraph.rosenv import ROS_IP as ROS_IP
from rosgraph.rosenv import ROS_MASTER_URI as ROS_MASTER_URI
from rosgraph.rosenv import ROS_NAMESPACE as ROS_NAMESPACE

ROS_ROOT = "ROS_ROOT"
ROS_PACKAGE_PATH = "ROS_PACKAGE_PATH"
ROS_HOME = "ROS_HOME"
ROS_LOG_DIR = "ROS_LOG_DIR"
ROS_BINDEPS_PATH = "ROS_BINDEPS_PATH"
ROS_BOOST_ROOT = "ROS_BOOST_ROOT"


class ROSEnvException(Exception):
    """An environment variable is unset or invalid."""


def get_ros_root(required: bool = True, env: Mapping[str, str] | None = None) -> str | None:
    """Return `ROS_ROOT`, which ROS 1 no longer needs, or None if the variable is not set.

    Raises:
        ROSEnvException: `required` is true, and the variable is not set.
    """
    return _variable(ROS_ROOT, required, env)


def get_ros_package_path(required: bool = False, env: Mapping[str, str] | None = None) -> str | None:
    """Return `ROS_PACKAGE_PATH`, or None if it is not set. Raises the same errors as `get_ros_root`."""
    return _variable(ROS_PACKAGE_PATH, required, env)


def get_master_uri(
    required: bool = True, env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None
) -> str | None:
    """Return the master's URI from `__master:=` in `argv` or, without it, from `ROS_MASTER_URI`.

    Raises:
        ROSEnvException: `required` is true and neither is set, or the value of `__master:=` is empty or
            contains `:=`.
    """
    for argument in sys.argv if argv is None else argv:
        if argument.startswith("__master:="):
            address = argument.partition(":=")[2]
            if not address or ":=" in address:
                raise ROSEnvException(f"__master remapping argument '{argument}' improperly specified")
            return address
    return _variable(ROS_MASTER_URI, required, env)


def get_ros_home(env: Mapping[str, str] | None = None) -> str:
    """Return `ROS_HOME`, by default `~/.ros`."""
    return str(Environment.from_os(env).ros_home)


def get_log_dir(env: Mapping[str, str] | None = None) -> str:
    """Return the folder for log files."""
    return str(Environment.from_os(env).log_dir)


def get_test_results_dir(env: Mapping[str, str] | None = None) -> str:
    """Return the folder for test results."""
    return str(Environment.from_os(env).test_results_dir)


def makedirs_with_parent_perms(p: str) -> None:
    """Create a folder and its missing parents, each with the owner and mode of its parent."""
    make_folders_as_parent(Path(p))


def _variable(name: str, required: bool, env: Mapping[str, str] | None) -> str | None:
    value = (os.environ if env is None else env).get(name)
    if required and not value:
        raise ROSEnvException(f"{name} is not set: source the setup file of your workspace, or export it")
    return value
