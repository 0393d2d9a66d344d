"""The subcommands of `pipros`: its own, and those of rooms."""

from __future__ import annotations

from pipros.basics.rooms import RoomCommand, rooms

SUBCOMMANDS = {
    "doctor": RoomCommand(
        "pipros.cli.doctor:main",
        "check the environment, every node, topic and service, and say what to do",
        "Find out what is wrong",
    ),
    "env": RoomCommand(
        "pipros.cli.show_env:main",
        "print what to evaluate instead of sourcing a setup file",
        "Make packages and workspaces",
    ),
    "policy": RoomCommand(
        "pipros.cli.policy:main",
        "say what a policy lets clients of servers do, and test it with a bag",
        "Find out what is wrong",
        "check",
    ),
    "stubs": RoomCommand(
        "pipros.cli.stubs:main",
        "write type stubs for the messages of packages, for editors",
        "Look up messages, services and actions",
    ),
    "version": RoomCommand(
        "pipros.cli.version:main", "print the versions of pipros, Python and ROS", "Find packages"
    ),
}
"""The subcommands that are always installed."""


def subcommands() -> dict[str, RoomCommand]:
    """Return all installed subcommands by name. Subcommands of rooms come last."""
    found = dict(SUBCOMMANDS)
    for room in rooms():
        found |= room.subcommands
    return found
