"""The declaration of the page; see `pipros.basics.plugins`."""

from pipros.basics.plugins import Plugin, PluginCommand

_HEADING = "See a running system in a browser"


def _tool(name: str, purpose: str) -> PluginCommand:
    return PluginCommand(f"pipros_page.commands.rqt:{name}", purpose, _HEADING)


_GRAPH = "pipros_page.commands.rqt_graph:main"

PLUGIN = Plugin(
    "page",
    "the page of the rqt commands and rviz",
    programs={
        "rqt_graph": PluginCommand(_GRAPH, "the graph, live, or as a picture", _HEADING),
        "rqt_topic": _tool("rqt_topic", "topics with rates and their newest messages"),
        "rqt_plot": _tool("rqt_plot", "numeric fields as curves"),
        "rqt_console": _tool("rqt_console", "log messages, with filters"),
        "rqt_logger_level": _tool("rqt_logger_level", "the logger levels of nodes"),
        "rqt_top": _tool("rqt_top", "CPU and memory usage of nodes"),
        "rqt_image_view": _tool("rqt_image_view", "images"),
        "rqt_bag": _tool("rqt_bag", "bags on a timeline"),
        "rqt_tf_tree": _tool("rqt_tf_tree", "coordinate frames"),
        "rviz": PluginCommand(
            "pipros_page.commands.rviz:main", "robots, sensors and maps in 3D, from .rviz files", _HEADING
        ),
        "rqt_robot_monitor": _tool("rqt_robot_monitor", "diagnostics"),
        "rqt_reconfigure": _tool("rqt_reconfigure", "parameters of dynamic_reconfigure"),
        "rqt_service_caller": _tool("rqt_service_caller", "list and call services"),
        "rqt_publisher": _tool("rqt_publisher", "publish messages"),
        "rqt": _tool("rqt", "all of these on one page"),
    },
    subcommands={
        "graph": PluginCommand(_GRAPH, "the same as rqt_graph", _HEADING),
    },
    limits="pipros_page.limits:PageLimits",
    offers={
        "page": "pipros_page.serve_page:MountedPage",
        "rqt_modules": "pipros_page.instead:MODULES",
        "rqt_plugins": "pipros_page.instead:PLUGINS",
    },
)
