"""The declaration of the room for assistants; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

ROOM = Room(
    "assistants",
    "tools for assistants",
    subcommands={
        "mcp": RoomCommand(
            "pipros.assistants.commands.mcp:main",
            "serve an assistant with tools that read the system, or act after approval",
            "Connect the system to others",
            "approve",
        )
    },
    limits="pipros.assistants.limits:AssistantLimits",
    # mcp 2.3 is the oldest tested version; mcp 3 may change the classes used here.
    extras={"mcp": ("mcp>=2.3,<3", "pillow>=10.1")},
)
