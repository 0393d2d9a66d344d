"""Starts nodes on other computers through the system's ssh client.

The remote command, `[env-loader] env VARIABLE=value… rosrun package type argument…`, works with any ROS 1
installation. The client requests a remote terminal, so that the node gets SIGHUP when the connection ends for
any reason.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence

from pipros_tools.launch.model import LaunchNode, Machine


def remote_command(
    machine: Machine, node: LaunchNode, overlay: Mapping[str, str], arguments: Sequence[str]
) -> list[str]:
    """Return the ssh command line that runs a node on a machine.

    The machine's password is ignored, because ssh accepts no password on the command line, where every user
    could read it. The login requires a key or an agent.
    """
    prefix = ["--prefix", node.launch_prefix] if node.launch_prefix else []
    remote = [
        *shlex.split(machine.env_loader),
        "env",
        *(f"{name}={value}" for name, value in overlay.items()),
        "rosrun",
        *prefix,
        node.package,
        node.type,
        *arguments,
    ]
    return ssh_command(machine, remote)


def ssh_command(machine: Machine, words: Sequence[str]) -> list[str]:
    """Return the ssh command line that runs `words` on a machine, in a remote terminal."""
    destination = f"{machine.user}@{machine.address}" if machine.user else machine.address
    return [
        "ssh",
        "-tt",
        "-o",
        "BatchMode=yes",
        "-o",
        f"ConnectTimeout={math.ceil(machine.timeout_s)}",
        "-p",
        str(machine.ssh_port),
        "--",
        destination,
        shlex.join(words),
    ]
