"""`rqt`, and commands such as `rqt_plot` and `rqt_bag`, each of which opens the page at its tab."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from pipros_page.commands.page_command import page_parser, show
from pipros_page.commands.rqt_graph import main as rqt_graph
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, add_flag, run
from pipros_tools.cli.server_options import without_remappings
from pipros_tools.graph.client import GraphClient

Main = Callable[[Sequence[str] | None], int]


def _tool(
    name: str, tab: str, argument: str = "", *, max_arguments: int | None = 1, change: str = ""
) -> Main:
    """Return a command that opens a tab.

    `argument` describes the command's arguments, and is empty if the command takes none.
    `max_arguments` is the maximum number of arguments; None for no limit.

    `change` is the view or action that the page may use on loopback even without `--control`; see
    `pipros_page.tabs.CHANGING`.
    """
    limit = max_arguments if argument else 0

    def body(argv: Sequence[str]) -> int:
        parser = page_parser(name, f"[options] {argument}".rstrip())
        options, words = parser.parse_args(without_remappings(argv))
        if limit is not None and len(words) > limit:
            parser.error(f"unexpected argument: {words[-1]}")
        with GraphClient(name) as graph:
            wanted = ",".join(_resolved(graph, word) for word in words)
        return show(name, f"{tab}/{quote(wanted, safe='')}" if wanted else tab, options, change)

    @command
    def main(argv: Sequence[str] | None = None) -> int:
        return run(lambda: body(sys.argv[1:] if argv is None else argv))

    main.__name__ = name
    return main


def _resolved(graph: GraphClient, word: str) -> str:
    """Resolve a topic, node or field name. Everything from the first `[` or `:` on stays unchanged."""
    end = min((at for at in map(word.find, ":[") if at >= 0), default=len(word))
    return graph.resolve(word[:end]) + word[end:]


@command
def rqt_bag(argv: Sequence[str] | None = None) -> int:
    """Open the page at the Bags tab, for the given bag's folder or, by default, the working directory."""
    return run(lambda: _show_bags(sys.argv[1:] if argv is None else argv))


def _show_bags(argv: Sequence[str]) -> int:
    parser = page_parser("rqt_bag", "[options] [bag]")
    options, words = parser.parse_args(without_remappings(argv))
    if len(words) > 1:
        parser.error(f"unexpected argument: {words[1]}")
    path = Path(words[0]).absolute() if words else None
    if path is not None and not path.is_file():
        raise CommandError(f"there is no bag {words[0]}")
    if options.bags is None:
        options.bags = str(path.parent if path is not None else Path.cwd())
    name = "" if path is None else str(path.resolve().relative_to(_folder_of(options.bags, path)))
    return show("rqt_bag", f"bags/{quote(name, safe='')}" if name else "bags", options)


def _folder_of(bags: str, path: Path) -> Path:
    folder = Path(bags).resolve()
    if not path.resolve().is_relative_to(folder):
        raise CommandError(f"{path} must be in {bags}, the folder given with --bags")
    return folder


rqt_console = _tool("rqt_console", "console")
rqt_image_view = _tool("rqt_image_view", "images", "[topic]")
rqt_logger_level = _tool("rqt_logger_level", "console", "[node]", change="set_logger_level")
rqt_plot = _tool("rqt_plot", "plot", "[/topic/field1:field2 ...]", max_arguments=None)
rqt_publisher = _tool("rqt_publisher", "publish", "[topic]", change="publishing")
rqt_reconfigure = _tool("rqt_reconfigure", "reconfigure", "[server]", change="set_reconfigured")
rqt_robot_monitor = _tool("rqt_robot_monitor", "diagnostics")
rqt_service_caller = _tool("rqt_service_caller", "services", "[service]", change="call_service")
rqt_tf_tree = _tool("rqt_tf_tree", "tf")
rqt_top = _tool("rqt_top", "nodes")
rqt_topic = _tool("rqt_topic", "topics", "[topic]")


def _robot_steering(argv: Sequence[str] | None = None) -> int:
    from pipros_page.robot_steering import main

    return main(argv)


_PLUGINS: Mapping[str, Main] = {
    "bag": rqt_bag,
    "console": rqt_console,
    "graph": rqt_graph,
    "image_view": rqt_image_view,
    "logger_level": rqt_logger_level,
    "nodes": rqt_top,
    "plot": rqt_plot,
    "publisher": rqt_publisher,
    "reconfigure": rqt_reconfigure,
    "robot_monitor": rqt_robot_monitor,
    "robot_steering": _robot_steering,
    "service_caller": rqt_service_caller,
    "tf_tree": rqt_tf_tree,
    "top": rqt_top,
    "topic": rqt_topic,
}
"""The commands that replace rqt plugins, by their names without `rqt_`."""


@command
def rqt(argv: Sequence[str] | None = None) -> int:
    """Run `rqt`.

    With `-s NAME` (`--standalone`), run one plugin's command. With `--perspective-file FILE` or `-p NAME`,
    open the page with that panel layout. Otherwise, open the page at the view that the browser showed last.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run(lambda: _run_plugin(arguments))


def _run_plugin(arguments: list[str]) -> int:
    plugin, rest = _standalone(arguments)
    if plugin is None:
        return _show_layout(rest)
    # Noetic accepts a plugin's name in several forms: rqt_graph, rqt_graph/RosGraph,
    # rqt_graph.ros_graph.RosGraph.
    name = re.split(r"[/.]", plugin)[0].lower().removeprefix("rqt_")
    if name not in _PLUGINS:
        known = ", ".join(sorted(_PLUGINS))
        raise CommandError(f"pipros has no rqt plugin [{plugin}]; the plugins are {known}")
    return _PLUGINS[name](rest)


def _show_layout(arguments: list[str]) -> int:
    parser = page_parser("rqt", "[options]")
    parser.add_option("--perspective-file", metavar="FILE", help="a panel layout, or an rqt perspective")
    parser.add_option("-p", "--perspective", metavar="NAME", help="a stored panel layout")
    add_flag(parser, "--clear-config", help="ignored, because the page keeps no configuration")
    options, words = parser.parse_args(without_remappings(arguments))
    if words:
        parser.error(f"unexpected argument: {words[0]}")
    if options.perspective and options.perspective_file:
        parser.error("--perspective and --perspective-file cannot be combined")
    panels = _panels(options.perspective, options.perspective_file)
    return show("rqt", f"panels/{quote(panels, safe='')}" if panels else "", options)


def _panels(name: str | None, file: str | None) -> str:
    """Return the panels of a stored layout or a layout file, or an empty string if neither is given."""
    from pipros_page.layouts import StoredLayouts, open_layout

    try:
        if name is not None:
            return StoredLayouts().load(name)
        if file is None:
            return ""
        opened = open_layout(file)
    except OSError as error:
        raise CommandError(f"cannot read {error.filename or name}: {error.strerror or error}") from None
    if opened.skipped:
        print(f"rqt: the page has no tab for {', '.join(opened.skipped)}", file=sys.stderr)
    return opened.panels


def _standalone(arguments: list[str]) -> tuple[str | None, list[str]]:
    """Return the plugin given with `-s` (None if there is no `-s`) and the other arguments."""
    for at, word in enumerate(arguments):
        option, equals, value = word.partition("=")
        if option == "--standalone" and equals:
            return value, arguments[:at] + arguments[at + 1 :]
        if word in ("-s", "--standalone"):
            if at + 1 == len(arguments):
                raise CommandError(f"{word} must be followed by a plugin name")
            return arguments[at + 1], arguments[:at] + arguments[at + 2 :]
    return None, arguments
