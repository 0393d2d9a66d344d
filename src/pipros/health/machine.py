"""The setup of this machine and this shell, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path


class PathKind(Enum):
    """What a path leads to."""

    FOLDER = "folder"
    READ_ONLY = "read-only folder"
    FILE = "file"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Machine:
    """Everything that the checks of a machine look at.

    Attributes:
        variables: the environment variables.
        hostname: the name of this machine.
        addresses: its IP addresses, as far as they are known, loopback first.
        resolved: host name to the addresses that it means; none when it is unknown. Has the name of this
            machine, and the hosts of `ROS_MASTER_URI` and `ROS_HOSTNAME`.
        own_hosts: those hosts and addresses in question that mean this machine.
        address_towards_master: the address from which this machine reaches the master; empty when unknown.
        paths: path to what it is: entries of the path variables and the folders for logs.
        foreign_programs: command of ROS to the program that `PATH` finds for it, if it is not of pipros.
        own_programs: the folder of pipros' programs.
        python_packages: import package to the folder from which Python takes it.
        own_packages: the folder of pipros' import packages.
        master_error: why the master cannot be reached; empty when it answers, None when it was not asked.
        has_local_master: whether a master answers at the default address of this machine.
        workspace: the devel space of the workspace around the current folder, if there is one.
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
    own_packages: Path = Path("/nowhere/src")
    master_error: str | None = None
    has_local_master: bool = False
    workspace: Path | None = None
