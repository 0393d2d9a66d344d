"""The declaration of the plugin for assistants; see `pipros.basics.plugins`."""

from pipros.basics.plugins import BETA, Plugin, PluginCommand

PLUGIN = Plugin(
    "assistants",
    "tools for assistants",
    subcommands={
        "mcp": PluginCommand(
            "pipros_assistants.commands.mcp:main",
            "serve an assistant with tools that read the system, or act after approval",
            "Connect the system to others",
            "approve",
        )
    },
    limits="pipros_assistants.limits:AssistantLimits",
    features={
        "tools that read": BETA,
        "acts after approval": BETA,
    },
)
