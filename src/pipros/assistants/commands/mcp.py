"""`pipros mcp`: serves tools that read the system to an assistant."""

from __future__ import annotations

import os
import signal
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import MissingExtra
from pipros.cli.entry_point import command
from pipros.cli.runner import CommandError, run

if TYPE_CHECKING:
    from pipros.assistants.robot import Robot


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Serve until the client closes the connection, or until Ctrl-C. Return the exit code."""
    parser = ArgumentParser(
        prog="pipros mcp",
        description="Serves tools for assistants (Model Context Protocol) that read the running system and "
        "bags, over standard input and output, or with --http to clients on this machine. No tool changes "
        "anything. docs/assistants.md has files that configure clients.",
    )
    parser.add_argument("--bags", type=Path, metavar="FOLDER", help="the folder whose bags may be read")
    parser.add_argument(
        "--http",
        type=int,
        metavar="PORT",
        help="serve streamable HTTP at this port of the loopback address; 0 selects a free one",
    )
    parser.add_argument("--token-file", metavar="FILE", help="with --http: file with the accepted tokens")
    options = parser.parse_args(argv)
    if options.http is not None and not 0 <= options.http <= 65535:
        parser.error(f"--http must be a port from 0 to 65535, got {options.http}")
    if options.token_file and options.http is None:
        parser.error("--token-file needs --http")
    return run(lambda: _serve(options.bags, options.http, options.token_file))


def _serve(bags: Path | None, port: int | None, token_file: str | None) -> int:
    if bags is not None and not bags.is_dir():
        raise CommandError(f"--bags must be a folder, got {bags}")
    try:
        from pipros.assistants.server import make_server
    except ImportError as error:
        from pipros.basics.extras import install_command

        missing = error.name or str(error)
        text = f"pipros mcp needs {missing}, which is not installed. Try: {install_command('mcp')}"
        raise CommandError(text) from MissingExtra(text, name=error.name)
    from pipros.assistants import robot as robots
    from pipros.basics.env import Environment

    robot = robots.Robot(Environment.from_os())
    server = make_server(robot, bags)
    try:
        if port is not None:
            from pipros.assistants.http_server import serve_http

            return serve_http(server, port, token_file)
        import asyncio

        if sys.stdin.isatty():
            print("An assistant starts this command, and talks to it. Ctrl-C ends it.", file=sys.stderr)
        _end_at_once_by_signals(robot)
        asyncio.run(server.run_stdio_async())
        return 0
    finally:
        robot.close()


def _end_at_once_by_signals(robot: Robot) -> None:
    """Exit at once on SIGINT and SIGTERM; the library's thread, which blocks in a read, is not awaited."""

    def end(number: int, _frame: object) -> None:
        robot.close()
        os._exit(128 + number)

    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, end)
