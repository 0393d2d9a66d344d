"""Determines which computer each node of a launch runs on."""

from __future__ import annotations

from collections.abc import Mapping

from pipros.net.this_machine import is_this_machine
from pipros_tools.launch.model import LaunchNode, Machine


class Placement:
    """Maps nodes to machines. The address of each machine is looked up at most once."""

    def __init__(self, machines: Mapping[str, Machine]) -> None:
        """Store the launch's machines by name."""
        self._machines = machines
        self._is_local: dict[str, bool] = {}

    def remote_machine(self, node: LaunchNode) -> Machine | None:
        """Return the machine of a node that is started through ssh, or None for a local node."""
        machine = self._machines.get(node.machine)
        if machine is None:
            return None
        if machine.name not in self._is_local:
            self._is_local[machine.name] = is_local(machine)
        return None if self._is_local[machine.name] else machine


def is_local(machine: Machine) -> bool:
    """Return whether a machine's nodes start without ssh.

    This is the case if the machine is this computer and its user is this process's user.
    """
    if machine.user:
        import getpass

        try:
            this_user = getpass.getuser()
        except (KeyError, OSError):  # the user id has no name
            return False
        if machine.user != this_user:
            return False
    return is_this_machine(machine.address)
