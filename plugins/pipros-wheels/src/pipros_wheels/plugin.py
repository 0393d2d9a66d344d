"""The declaration of the plugin `wheels`; see `pipros.basics.plugins`."""

from pipros.basics.plugins import BETA, EXPERIMENTAL, Plugin, PluginCommand

_HEADING = "Build and install wheels of packages"

PLUGIN = Plugin(
    "wheels",
    "wheels of ROS packages, for pip",
    programs={
        "rosdep": PluginCommand(
            "pipros_wheels.commands.rosdep:main",
            "list and install the Python projects that packages need",
            _HEADING,
            "check init install keys update",
        ),
    },
    subcommands={
        "wheel": PluginCommand("pipros_wheels.commands.wheel:main", "build wheels of packages", _HEADING),
        "install": PluginCommand(
            "pipros_wheels.commands.install:main",
            "build packages, and install them with their dependencies",
            _HEADING,
        ),
        "index": PluginCommand(
            "pipros_wheels.commands.index:main",
            "write an index for pip and a lock file for a folder of wheels",
            _HEADING,
        ),
    },
    features={
        "wheels of Python packages": BETA,
        "indexes and plans": BETA,
        "wheels for ROS 2": EXPERIMENTAL,
    },
)
