"""The declaration of fleets; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

ROOM = Room(
    "fleet",
    "masters joined over a network",
    subcommands={
        "fleet": RoomCommand(
            "pipros.fleet.commands:main",
            "join masters over a network; run, inspect and secure such a fleet",
            "Connect the system to others",
            "check history info join keys list param router top",
        ),
    },
    limits="pipros.fleet.limits:FleetLimits",
    check="pipros.fleet.health:CHECK",
    # Zenoh's defaults change between minor versions, so only a tested one is allowed. `pipros fleet keys`
    # needs cryptography.
    extras={"fleet": ("cryptography>=42", "eclipse-zenoh>=1.10,<1.11")},
)
