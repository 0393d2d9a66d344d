"""The declaration of the servers for rosbridge and Foxglove; see `pipros.basics.plugins`."""

from pipros.basics.plugins import Plugin, PluginCommand

_HEADING = "Connect the system to others"

PLUGIN = Plugin(
    "bridges",
    "servers for rosbridge and Foxglove",
    subcommands={
        "serve": PluginCommand(
            "pipros_bridges.commands.serve:main",
            "serve the page, rosbridge and Foxglove on one port",
            _HEADING,
        ),
        "foxglove": PluginCommand(
            "pipros_bridges.commands.foxglove:main", "serve the system to Foxglove and Lichtblick", _HEADING
        ),
        "clients": PluginCommand(
            "pipros_bridges.commands.clients:main",
            "list the clients of pipros serve or pipros foxglove",
            _HEADING,
        ),
    },
    limits="pipros_bridges.limits:BridgeLimits",
)
