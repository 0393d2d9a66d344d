"""`pipros mcp` serves tools to an assistant; `pipros mcp approve` asks a human to approve the tools' acts."""

from __future__ import annotations

import os
import signal
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import MissingExtra
from pipros.basics.interrupts import ENDING_SIGNALS
from pipros_tools.cli.entry_point import INTERRUPTED, command
from pipros_tools.cli.runner import CommandError, run

if TYPE_CHECKING:
    from pipros.basics.env import Environment
    from pipros_assistants.robot import RobotAccess
    from pipros_server.approved_acts import ApprovedActs

ASSISTANT_APPROVALS = 8
"""Limit: number of acts that await approval at the same time; those of one token are at most half of what
others leave. Beyond it, the act is refused at once, so that the human does not receive too many requests.
"""
ASSISTANT_ACT_CHARACTERS = 4_000
"""Limit: length of an act's values, which are shown to the human in full. Beyond it, the act is refused,
because a human could not see all of its values.
"""
ASSISTANT_RUNS = 4
"""Limit: number of launch files and recordings that run at the same time. Beyond it, the launch file or
recording is not started.
"""


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run `pipros mcp approve`, or serve until the client leaves or SIGINT arrives. Return the exit code."""
    parser = ArgumentParser(
        prog="pipros mcp",
        description="Serves assistants (Model Context Protocol) with tools that read the running system and "
        "bags, over standard input and output or, with --http, to clients on this machine. With a policy, "
        "further tools act on the system after a human has approved each act, with `pipros mcp approve` in "
        "another terminal or on the page. docs/guides/assistants.md has configuration files for clients.",
    )
    parser.add_argument(
        "what", nargs="?", choices=("approve",), help="ask at this terminal whether to approve acts"
    )
    parser.add_argument(
        "--bags", type=Path, metavar="FOLDER", help="the folder in which bags may be read and recorded"
    )
    parser.add_argument("--policy", metavar="FILE", help="what tools may do to the system; see pipros policy")
    parser.add_argument("--simulate", action="store_true", help="run a simulated robot, and serve it instead")
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
    if options.what:
        if options.bags or options.policy or options.simulate or options.http is not None:
            parser.error("approve takes no options")
        return run(_approve)
    return run(lambda: _serve(options))


def _approve() -> int:
    from pipros_server.terminal_approvals import ask_humans

    if not sys.stdin.isatty():
        raise CommandError("pipros mcp approve must run in a terminal, because a human must answer")
    try:
        ask_humans()
    except KeyboardInterrupt:
        return INTERRUPTED
    except OSError as error:
        raise CommandError(f"cannot find the acts that await approval: {error}") from None
    return 0


def _serve(options: Namespace) -> int:
    if options.bags is not None and not options.bags.is_dir():
        raise CommandError(f"--bags must be a folder, got {options.bags}")
    try:
        from pipros_assistants.server import make_server

        if options.http is not None:
            from pipros_assistants.http_server import serve_http
    except ImportError as error:
        from pipros.basics.extras import install_command

        missing = error.name or str(error)
        text = (
            f"pipros mcp needs {missing}, which is not installed. Try: {install_command('pipros-assistants')}"
        )
        raise CommandError(text) from MissingExtra(text, name=error.name)
    from pipros.basics.env import Environment
    from pipros.basics.plugins import offered
    from pipros_assistants.robot import RobotAccess

    with ExitStack() as stack:
        environment, wait = Environment.from_os(), lambda: None
        if options.simulate:
            simulated_robot = offered("practice")
            if simulated_robot is None:
                raise CommandError(
                    "--simulate needs simulated robots, which this installation of pipros lacks"
                )
            environment, wait = stack.enter_context(simulated_robot(environment))
        robot = RobotAccess(environment, wait=wait)
        stack.callback(robot.close)
        acts = None
        if options.policy is not None:
            acts = _acts(options.policy, robot, environment)
            stack.callback(acts.close)
        server = make_server(robot, options.bags, acts)
        if options.http is not None:
            return serve_http(server, options.http, options.token_file)
        import asyncio

        from pipros_assistants.stdio_transport import ASSISTANT_REQUEST_BYTES, serve_stdio

        if sys.stdin.isatty():
            print("This command should be started by an assistant. Press Ctrl-C to end it.", file=sys.stderr)
        _end_at_once_by_signals(stack)
        try:
            asyncio.run(serve_stdio(server, ASSISTANT_REQUEST_BYTES))
        except Exception as error:
            while parts := getattr(error, "exceptions", ()):  # an ExceptionGroup, which Python 3.10 lacks
                error = parts[0]
            if isinstance(error, BrokenPipeError):  # the client has ended; `command` ends quietly
                sys.unraisablehook = lambda _: None  # Python 3.14 reports the answers that are left
                raise error from None
            raise
    return 0


def _acts(policy: str, robot: RobotAccess, environment: Environment) -> ApprovedActs:
    """Return the acts that a policy allows. Other programs can approve them from now on."""
    from pipros_server.approved_acts import ActLimits, ApprovedActs
    from pipros_server.policy.policy_file import read_policy

    limits = robot.limits
    acts = ApprovedActs(
        environment,
        read_policy(policy),
        ActLimits(
            ASSISTANT_APPROVALS,
            limits.assistant_approval_s,
            ASSISTANT_ACT_CHARACTERS,
            ASSISTANT_RUNS,
        ),
    )
    try:
        acts.approvals.start()
    except OSError as error:
        raise CommandError(f"cannot offer acts for approval: {error}") from None
    return acts


def _end_at_once_by_signals(stack: ExitStack) -> None:
    """Make SIGINT and SIGTERM exit immediately, without waiting for the thread that reads standard input."""

    def end(number: int, _frame: object) -> None:
        stack.close()
        os._exit(128 + number)

    for each in ENDING_SIGNALS:
        signal.signal(each, end)
