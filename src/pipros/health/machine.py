"""The setup of this machine and this shell, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path


class PathKind(Enum):
    """Kind of file system entry at a path."""

    FOLDER = "folder"
    READ_ONLY = "read-only folder"
    FILE = "file"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Machine:
    """Input of the machine checks.

    Attributes:
        variables: the environment variables.
        hostname: the name of this machine.
        addresses: the machine's known IP addresses, loopback first.
        resolved: host name to its addresses, empty if it cannot be resolved: for the name of this machine
            and the hosts of `ROS_MASTER_URI` and `ROS_HOSTNAME`.
        own_hosts: the hosts and addresses among these that refer to this machine.
        address_towards_master: the address from which this machine reaches the master; empty if unknown.
        paths: path to its kind, for the entries of path variables and the folders for logs.
        foreign_programs: ROS command to the program in `PATH` that runs, if it is not pipros's program.
        own_programs: the folder of pipros' programs.
        python_packages: import package to the folder from which Python imports it.
        own_packages: the folders with pipros's import packages; one, except in a checkout.
        changed_packages: import package of pipros that changed after its installation, to the distribution
            that replaced its files; empty if unknown.
        master_error: why the master cannot be reached; empty if it answers, None if it was not called.
        has_local_master: whether a master answers at the default address of this machine.
        bound_host: the address that nodes listen on.
        port_problem: why no port of `PIPROS_PORTS` can be opened; empty if one can, or it is unset or
            invalid.
        not_called_back: the URI of this machine that the master was given and did not call; empty if it did,
            or this was not tested.
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
    own_packages: frozenset[Path] = frozenset()
    changed_packages: Mapping[str, str] = field(default_factory=dict)
    master_error: str | None = None
    has_local_master: bool = False
    bound_host: str = "0.0.0.0"  # noqa: S104  # a value, nothing is bound
    port_problem: str = ""
    not_called_back: str = ""
    workspace: Path | None = None
