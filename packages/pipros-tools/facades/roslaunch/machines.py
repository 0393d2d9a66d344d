"""The computers on which a launch starts nodes, with Noetic's names. `roslaunch.core` has them, too."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from functools import cache

from pipros_tools.launch import model, placement
from pipros_tools.launch.model import LaunchError

_REGISTER_TIMEOUT_S = 10.0


class Machine:
    """A computer on which nodes can be started."""

    __slots__ = ("address", "assignable", "env_loader", "name", "password", "ssh_port", "timeout", "user")

    def __init__(
        self,
        name: str,
        address: str,
        env_loader: str | None = None,
        ssh_port: int = 22,
        user: str | None = None,
        password: str | None = None,
        assignable: bool = True,
        env_args: Sequence[object] = (),
        timeout: float | None = None,
    ) -> None:
        _ = env_args
        self.name = name
        self.env_loader = env_loader
        self.user = user or None
        self.password = password
        self.address = address
        self.ssh_port = ssh_port
        self.assignable = assignable
        self.timeout = timeout or _REGISTER_TIMEOUT_S

    def config_key(self) -> str:
        """Return a string that is equal for machines that differ only in `name` and `assignable`."""
        return (
            f"Machine(address[{self.address}] env_loader[{self.env_loader}] ssh_port[{self.ssh_port}] "
            f"user[{self.user or ''}] password[{self.password or ''}] timeout[{self.timeout}])"
        )

    def config_equals(self, m2: object) -> bool:
        """Return whether `m2` is a machine with the same settings. `name` and `assignable` are ignored."""
        return isinstance(m2, Machine) and self.config_key() == m2.config_key()

    def to_model(self) -> model.Machine:
        """Return the corresponding pipros object."""
        return model.Machine(
            name=self.name,
            address=self.address,
            user=self.user or "",
            password=self.password or "",
            ssh_port=self.ssh_port,
            env_loader=self.env_loader or "",
            timeout_s=self.timeout,
        )

    @classmethod
    def from_model(cls, machine: model.Machine) -> Machine:
        """Create a Machine from the corresponding pipros object."""
        return cls(
            machine.name,
            machine.address,
            machine.env_loader or None,
            machine.ssh_port,
            machine.user or None,
            machine.password or None,
            timeout=machine.timeout_s,
        )

    def __eq__(self, m2: object) -> bool:
        return (
            isinstance(m2, Machine)
            and (self.name, self.assignable) == (m2.name, m2.assignable)
            and self.config_equals(m2)
        )

    __hash__ = None  # type: ignore[assignment]  # its attributes change

    def __str__(self) -> str:
        return (
            f"Machine(name[{self.name}] env_loader[{self.env_loader}] address[{self.address}] "
            f"ssh_port[{self.ssh_port}] user[{self.user}] assignable[{self.assignable}] "
            f"timeout[{self.timeout}])"
        )


@cache
def local_machine() -> Machine:
    """Return the Machine that represents this computer, which is always the same object."""
    return Machine("", "localhost")


def is_machine_local(machine: Machine) -> bool:
    """Return whether the machine refers to this computer and user, so that nodes can start without ssh.

    Raises:
        LaunchError: the machine's address cannot be resolved.
    """
    try:
        socket.getaddrinfo(machine.address, 0, 0, 0, socket.SOL_TCP)
    except (socket.gaierror, UnicodeError):
        raise LaunchError(f"cannot resolve host address for machine [{machine.address}]") from None
    return placement.is_local(machine.to_model())
