"""The subcommands of `pipros`: its own, and those of plugins."""

from __future__ import annotations

from pipros.basics.plugins import PluginCommand, plugins

SUBCOMMANDS = {
    "doctor": PluginCommand(
        "pipros_tools.cli.doctor:main",
        "check the environment, every node, topic and service, and say what to do",
        "Find out what is wrong",
    ),
    "env": PluginCommand(
        "pipros_tools.cli.show_env:main",
        "print what to evaluate instead of sourcing a setup file",
        "Make packages and workspaces",
    ),
    "plugins": PluginCommand(
        "pipros_tools.cli.list_plugins:main",
        "list plugins, how far their features are proven, and how to install others",
        "Find packages",
    ),
    "policy": PluginCommand(
        "pipros_tools.cli.policy:main",
        "say what a policy lets clients of servers do, and test it with a bag",
        "Find out what is wrong",
        "check",
    ),
    "stubs": PluginCommand(
        "pipros_tools.cli.stubs:main",
        "write type stubs for the messages of packages, for editors",
        "Look up messages, services and actions",
    ),
    "version": PluginCommand(
        "pipros_tools.cli.version:main", "print the versions of pipros, Python and ROS", "Find packages"
    ),
}
"""The subcommands that are always installed."""


def subcommands() -> dict[str, PluginCommand]:
    """Return all installed subcommands by name. Subcommands of plugins come last."""
    found = dict(SUBCOMMANDS)
    for plugin in plugins():
        found |= plugin.subcommands
    return found
