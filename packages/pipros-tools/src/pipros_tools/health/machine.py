"""The setup of this machine and this shell, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from pipros_tools.health.windows_setup import WindowsReport


class PathKind(Enum):
    """The kind of file system entry at a path."""

    FOLDER = "folder"
    READ_ONLY = "read-only folder"
    FULL = "folder on a full disk"
    FILE = "file"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class MachineReport:
    """Input for the machine checks.

    Attributes:
        variables: the environment variables.
        hostname: this machine's name.
        addresses: the machine's known IP addresses, loopback first.
        resolved: maps this machine's name and the hosts in `ROS_MASTER_URI`, `ROS_HOSTNAME` and
            `PIPROS_ADVERTISE` to their addresses, which are empty if the host cannot be resolved.
        own_hosts: the hosts in `resolved` that refer to this machine, and `ROS_IP` if it does.
        address_towards_master: the address from which this machine reaches the master; empty if unknown.
        paths: maps the entries in path variables, `ROS_HOME`, and the folders for logs and test results to
            the kind of path.
        foreign_programs: maps ROS commands to the program in `PATH` that is run, if it is not pipros's.
        own_programs: the folder that contains pipros's programs.
        python_packages: maps import packages to the folder from which Python imports them.
        own_packages: the folders that contain pipros's import packages; a single folder, except in a
            checkout.
        changed_packages: maps each pipros import package that changed after its installation to the
            distribution that replaced its files, or to an empty string if that is unknown.
        master_error: why the master cannot be reached; empty if it responds; None if it was not called.
        other_master: the URI of a master that answers on this machine; tested only if none answers at
            `ROS_MASTER_URI`, and empty if there is none.
        missing_setup_files: maps missing ROS setup files to the shell startup file that sources them.
        bound_host: the address that nodes listen on.
        port_problem: why no port of `PIPROS_PORTS` can be opened; empty if one can, or if the variable is
            unset or invalid.
        not_called_back: the URI on this machine that the master received but did not call in time; empty if
            the master called it, or if this was not tested.
        ros2_packages: packages of ROS 2 in this environment that have the names of pipros's packages.
        workspace: the devel space of the workspace that contains the working directory, if there is one.
        windows: what may prevent programs from working on Windows and in WSL.
    """

    variables: Mapping[str, str]
    hostname: str = "localhost"
    addresses: tuple[str, ...] = ("127.0.0.1",)
    resolved: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    own_hosts: frozenset[str] = frozenset({"localhost", "127.0.0.1"})
    address_towards_master: str = ""
    paths: Mapping[str, PathKind] = field(default_factory=dict)
    foreign_programs: Mapping[str, Path] = field(default_factory=dict)
    own_programs: Path = Path("/nowhere/bin")
    python_packages: Mapping[str, Path] = field(default_factory=dict)
    own_packages: frozenset[Path] = frozenset()
    changed_packages: Mapping[str, str] = field(default_factory=dict)
    master_error: str | None = None
    other_master: str = ""
    missing_setup_files: Mapping[str, str] = field(default_factory=dict)
    bound_host: str = "0.0.0.0"  # noqa: S104  # a value, nothing is bound
    port_problem: str = ""
    not_called_back: str = ""
    ros2_packages: tuple[str, ...] = ()
    workspace: Path | None = None
    windows: WindowsReport = field(default_factory=WindowsReport)
