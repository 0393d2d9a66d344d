"""Find the programs that listen on this machine's ports, for the error text when no port is free."""

from __future__ import annotations

import os
from collections.abc import Container
from contextlib import suppress
from pathlib import Path

from pipros.basics.printable import printable
from pipros.net.this_machine import listening_inodes

_PROC = Path("/proc")
_NAMED = 20


def port_holders(ports: Container[int]) -> str:
    """List the programs that listen on these ports, as in `11400 python3 (pid 12)`. Lists at most 20 ports.

    Only root can identify other users' programs. The result is empty on systems other than Linux.
    """
    inodes = {inode: port for inode, port in listening_inodes().items() if port in ports}
    programs: dict[int, str] = {}
    for folder in _PROC.glob("[0-9]*/fd"):
        with suppress(OSError):  # the process belongs to another user, or has ended
            for descriptor in folder.iterdir():
                port = inodes.get(os.readlink(descriptor).removeprefix("socket:[").removesuffix("]"))
                if port is not None:
                    name = printable((folder.parent / "comm").read_text().strip())
                    programs[port] = f"{name} (pid {folder.parent.name})"
    listed = [f"{port} {programs.get(port, 'another user')}" for port in sorted(set(inodes.values()))]
    more = [f"and {len(listed) - _NAMED} more"] if len(listed) > _NAMED else []
    return ", ".join([*listed[:_NAMED], *more])
