"""The declaration of the room `wheels`; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

_HEADING = "Build and install wheels of packages"

ROOM = Room(
    "wheels",
    "wheels of ROS packages, for pip",
    programs={
        "rosdep": RoomCommand(
            "pipros.wheels.commands.rosdep:main",
            "list and install the Python projects that packages need",
            _HEADING,
            "check init install keys update",
        ),
    },
    subcommands={
        "wheel": RoomCommand("pipros.wheels.commands.wheel:main", "build wheels of packages", _HEADING),
        "install": RoomCommand(
            "pipros.wheels.commands.install:main",
            "build packages, and install them with their dependencies",
            _HEADING,
        ),
        "index": RoomCommand(
            "pipros.wheels.commands.index:main",
            "write an index for pip and a lock file for a folder of wheels",
            _HEADING,
        ),
    },
    limits="pipros.wheels.limits:WheelLimits",
)
