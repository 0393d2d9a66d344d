"""The declaration of the room for assistants; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

ROOM = Room(
    "assistants",
    "tools for assistants",
    subcommands={
        "mcp": RoomCommand(
            "pipros.assistants.commands.mcp:main",
            "serve tools to an assistant, which read the system, or act after approval",
            "Connect the system to others",
            "approve",
        )
    },
    limits="pipros.assistants.limits:AssistantLimits",
    # mcp: the first version tried; its 3.x may change the classes that this room uses.
    extras={"mcp": ("mcp>=2.3,<3", "pillow>=10.1")},
)
