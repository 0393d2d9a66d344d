"""The declaration of the page; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

_HEADING = "See a running system in a browser"


def _tool(name: str, purpose: str) -> RoomCommand:
    return RoomCommand(f"pipros.web.commands.rqt:{name}", purpose, _HEADING)


_GRAPH = "pipros.web.commands.rqt_graph:main"

ROOM = Room(
    "web",
    "the page of the rqt commands and rviz",
    programs={
        "rqt_graph": RoomCommand(_GRAPH, "the graph, live, or as a picture", _HEADING),
        "rqt_topic": _tool("rqt_topic", "topics with rates and their newest messages"),
        "rqt_plot": _tool("rqt_plot", "numeric fields as curves"),
        "rqt_console": _tool("rqt_console", "log messages, with filters"),
        "rqt_logger_level": _tool("rqt_logger_level", "the logger levels of nodes"),
        "rqt_top": _tool("rqt_top", "CPU and memory usage of nodes"),
        "rqt_image_view": _tool("rqt_image_view", "images"),
        "rqt_bag": _tool("rqt_bag", "bags on a timeline"),
        "rqt_tf_tree": _tool("rqt_tf_tree", "coordinate frames"),
        "rviz": RoomCommand(
            "pipros.web.commands.rviz:main", "robots, sensors and maps in 3D, from .rviz files", _HEADING
        ),
        "rqt_robot_monitor": _tool("rqt_robot_monitor", "diagnostics"),
        "rqt_reconfigure": _tool("rqt_reconfigure", "parameters of dynamic_reconfigure"),
        "rqt_service_caller": _tool("rqt_service_caller", "list and call services"),
        "rqt_publisher": _tool("rqt_publisher", "publish messages"),
        "rqt": _tool("rqt", "all of these on one page"),
    },
    subcommands={
        "graph": RoomCommand(_GRAPH, "the same as rqt_graph", _HEADING),
    },
    limits="pipros.web.limits:PageLimits",
    offers={
        "page": "pipros.web.serve_page:MountedPage",
        "rqt_modules": "pipros.web.instead:MODULES",
        "rqt_plugins": "pipros.web.instead:PLUGINS",
    },
    share=(
        "dynamic_reconfigure/scripts/reconfigure_gui",
        "image_view",
        *(f"rqt_{name}" for name in ("bag", "console", "graph", "gui", "image_view", "logger_level", "plot")),
        *(f"rqt_{name}" for name in ("publisher", "reconfigure", "robot_monitor", "robot_steering")),
        *(f"rqt_{name}" for name in ("service_caller", "tf_tree", "top", "topic")),
        "rviz",
        "urdf_tutorial",
    ),
)
