"""The declaration of fleets; see `pipros.basics.plugins`."""

from pipros.basics.plugins import BETA, Plugin, PluginCommand

PLUGIN = Plugin(
    "fleet",
    "masters joined over a network",
    subcommands={
        "fleet": PluginCommand(
            "pipros_fleet.commands:main",
            "join masters over a network; run, inspect and secure such a fleet",
            "Connect the system to others",
            "check history info join keys list param router top",
        ),
    },
    limits="pipros_fleet.limits:FleetLimits",
    check="pipros_fleet.health:CHECK",
    features={
        "topics, services and parameters": BETA,
        "history": BETA,
    },
)
