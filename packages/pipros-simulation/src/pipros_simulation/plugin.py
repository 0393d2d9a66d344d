"""The declaration of turtlesim and the simulated robots; see `pipros.basics.plugins`."""

from pipros.basics.plugins import Plugin, PluginCommand

PLUGIN = Plugin(
    "simulation",
    "turtlesim, and robots in a flat world",
    subcommands={
        "sim-for": PluginCommand(
            "pipros_simulation.commands.sim_for:main",
            "print a launch file that runs another one on a simulated robot",
            "Run",
        ),
    },
    offers={
        "instead": "pipros_simulation.instead:INSTEAD",
        "practice": "pipros_simulation.practice:simulated_robot",
    },
)
