"""`roswtf`: runs Noetic's checks, with its texts. `pipros doctor` finds more, and suggests remedies."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import PiprosError
from pipros.basics.names import parse_arguments
from pipros.basics.printable import printable_lines
from pipros.cli.command import add_flag, run
from pipros.cli.streams import command

if TYPE_CHECKING:
    from pipros.health.wtf.context import WtfContext
    from pipros.health.wtf.plugins import Check

_RULE = "=" * 80


@command
def main(argv: Sequence[str] | None = None, start_node: Callable[[], None] | None = None) -> int:
    """Print all problems. Return 0 regardless of the findings, like Noetic's.

    Args:
        start_node: called before online checks of plugins, which may need a node of their client library.
    """
    parser = OptionParser(
        usage="usage: roswtf [launch file]",
        prog="roswtf",
        description="roswtf is a tool for verifying a ROS installation and running system. Checks provided "
        "launchfile if provided, else current stack or package.",
    )
    add_flag(parser, "--all", dest="all_packages", help="run roswtf against all packages")
    add_flag(parser, "--no-plugins", dest="has_no_plugins", help="disable roswtf plugins")
    add_flag(parser, "--offline", dest="is_offline", help="only run offline tests")
    arguments = parse_arguments(list(sys.argv[1:] if argv is None else argv))
    options, files = parser.parse_args(list(arguments.rest))
    return run(lambda: _check(options, files, arguments.remappings, start_node))


def _check(
    options: Any,
    files: Sequence[str],
    arguments: Mapping[str, str],
    start_node: Callable[[], None] | None,
) -> int:
    from pipros.health.wtf.context import WtfException
    from pipros.health.wtf.plugins import load_plugins
    from pipros.health.wtf.report import print_results

    static: list[Check] = []
    online: list[Check] = []
    if not options.has_no_plugins:
        static, online = load_plugins(say=print, complain=_print_error)
    try:
        ctx = _context(files, arguments)
    except WtfException as error:
        _print_error(str(error))
        return 0
    if options.all_packages and ctx.index is not None:
        print("roswtf will run against all packages")
        ctx.pkgs = [package.name for package in ctx.index]
    _check_offline(ctx, static)
    print(_RULE)
    print("Static checks summary:\n")
    print_results(ctx)
    print(_RULE)
    if options.is_offline or not _has_master(ctx.ros_master_uri):
        print(
            "\nROS Master does not appear to be running.\nOnline graph checks will not be run.\n"
            f"ROS_MASTER_URI is [{ctx.ros_master_uri}]"
        )
        return 0
    ctx.errors, ctx.warnings = [], []
    _check_online(ctx, online, start_node)
    print("\nOnline checks summary:\n")
    print_results(ctx)
    return 0


def _context(files: Sequence[str], arguments: Mapping[str, str]) -> WtfContext:
    """Return the context of the launch files, the current folder's package, or the environment alone."""
    from pipros.health.wtf.context import WtfContext

    if files:
        return WtfContext.from_roslaunch(files, arguments=arguments)
    ctx = WtfContext.from_env()
    package = ctx.index.containing(Path.cwd()) if ctx.index is not None else None
    if package is None or ctx.index is None or ctx.index.get(package.name) is None:
        print("No package or stack in the current directory")
        return ctx
    print(f"Package: {package.name}")
    ctx.set_package(package.name)
    return ctx


def _check_offline(ctx: WtfContext, plugins: Sequence[Check]) -> None:
    from pipros.health.wtf import environment, network, packages, roslaunchwtf

    environment.wtf_check_environment(ctx)
    network.wtf_check(ctx)
    packages.wtf_check(ctx)
    roslaunchwtf.wtf_check_static(ctx)
    _run_plugins(plugins, ctx)


def _check_online(ctx: WtfContext, plugins: Sequence[Check], start_node: Callable[[], None] | None) -> None:
    from pipros.health.wtf import graph, roslaunchwtf

    print("Beginning tests of your ROS graph. These may take a while...")
    print("analyzing graph...", flush=True)
    graph.load_online(ctx, _print_error)
    print("... done analyzing graph\nrunning graph rules...", flush=True)
    graph.wtf_check_graph(ctx)
    print("... done running graph rules")
    roslaunchwtf.wtf_check_online(ctx)
    if plugins and start_node is not None:
        start_node()
    _run_plugins(plugins, ctx)


def _run_plugins(plugins: Sequence[Check], ctx: WtfContext) -> None:
    for check in plugins:
        try:
            check(ctx)
        except Exception as error:  # anything that the plugin's code raises
            _print_error(f"ERROR: plugin [{getattr(check, '__module__', check)}] failed: {error}")


def _has_master(uri: str) -> bool:
    from pipros.net.master_client import MasterClient

    try:
        client = MasterClient(uri, "/roswtf", timeout_s=5.0)
        client.get_pid()
        client.close()
    except (PiprosError, ValueError):
        return False
    return True


def _print_error(text: str) -> None:
    print(printable_lines(text), file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
