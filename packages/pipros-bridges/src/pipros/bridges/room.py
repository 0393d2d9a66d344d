"""The declaration of the servers for rosbridge and Foxglove; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

_HEADING = "Connect the system to others"

ROOM = Room(
    "bridges",
    "servers for rosbridge and Foxglove",
    subcommands={
        "serve": RoomCommand(
            "pipros.bridges.commands.serve:main",
            "serve the page, rosbridge and Foxglove on one port",
            _HEADING,
        ),
        "foxglove": RoomCommand(
            "pipros.bridges.commands.foxglove:main", "serve the system to Foxglove and Lichtblick", _HEADING
        ),
        "clients": RoomCommand(
            "pipros.bridges.commands.clients:main",
            "list the clients of pipros serve or pipros foxglove",
            _HEADING,
        ),
    },
    limits="pipros.bridges.limits:BridgeLimits",
    share=("foxglove_bridge", "rosapi", "rosbridge_library", "rosbridge_msgs", "rosbridge_server"),
    facades=("rosapi", "rosbridge_library", "rosbridge_server"),
    # for CBOR and BSON in rosbridge; the module `bson` belongs to pymongo, not to the package `bson`
    # orjson: for JSON in less time
    extras={"bridges": ("cbor2>=5.6", "orjson>=3.10", "pymongo>=4.6")},
)
