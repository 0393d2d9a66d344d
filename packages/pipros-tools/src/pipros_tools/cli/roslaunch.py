"""`roslaunch`: starts the nodes of launch files, or prints information about the files."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from optparse import Values
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import ENDING_SIGNALS
from pipros_tools.cli.entry_point import INTERRUPTED, command
from pipros_tools.cli.roslaunch_options import (
    check_child_options,
    check_combination,
    make_parser,
    run_options,
    session_options,
)
from pipros_tools.launch.arguments import split_arguments
from pipros_tools.launch.console import Console
from pipros_tools.launch.find_launch_files import NoSuchFiles, resolve_files
from pipros_workspace.index import PackageIndex

if TYPE_CHECKING:
    from pipros_tools.cli.roslaunch_inspect import Inspection
    from pipros_tools.launch.child import Child
    from pipros_tools.launch.session import LaunchSession

    Launching = LaunchSession | Child

_WAIT_ANSWER_S = 1.0
"""Time limit for one response from the master, after which `--wait` retries."""


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    parser = make_parser()
    options, words = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    arguments, words = split_arguments(words)
    console = Console(has_title=not options.disable_title, is_verbose=options.verbose)
    if options.child_name:
        check_child_options(parser, options, words)
        console = Console(has_title=False, is_verbose=options.verbose)
        return run(lambda: _child(options, console), console, options)
    check_combination(parser, options, words)
    index = PackageIndex.from_environment()
    try:
        files = resolve_files(words, index)
    except NoSuchFiles as error:
        parser.error(error.reason)
    except PiprosError as error:
        return report(console, error)
    show = _inspection(options, files)
    if show is not None:
        from pipros_tools.cli.roslaunch_inspect import inspect

        return inspect(show, files, arguments, index)
    return run(lambda: _session(options, files, arguments, console, index), console, options)


def run(make_session: Callable[[], Launching], console: Console, options: Values) -> int:
    """Start a session, wait until it ends, and always clean up. Return the exit code."""
    if options.wait:
        try:
            _wait_for_master(console)
        except KeyboardInterrupt:
            return INTERRUPTED
    pid_file = Path(options.pid_fn) if options.pid_fn else None
    session: Launching | None = None
    code = 0
    stop_handling = _handle_signals(lambda: session)
    try:
        if pid_file is not None:
            _write_pid(pid_file, console)
        session = make_session()
        session.start()
        if options.core and pid_file is None:
            pid_file = _pid_file_of_core(options.port)
            _write_pid(pid_file, console)
        session.wait()
    except KeyboardInterrupt:
        pass
    except (PiprosError, OSError) as error:
        code = report(console, error)
    finally:
        try:
            if session is not None:
                session.stop()
        finally:
            stop_handling()
            if pid_file is not None:
                _remove(pid_file)
    return code


def _write_pid(file: Path, console: Console) -> None:
    """Write this process's id to a file. If that fails, warn, and leave no empty file."""
    from pipros.basics.log_file import open_to_write
    from pipros.basics.planted import UntrustedFile

    try:
        try:
            descriptor = open_to_write(file, append=False)
        except UntrustedFile:
            file.unlink()
            descriptor = open_to_write(file, append=False)
        with open(descriptor, "w") as opened:
            opened.write(str(os.getpid()))
    except OSError as error:
        console.error(f"WARNING: cannot write the process id to [{file}]: {error.strerror}")
        _remove(file)


def _remove(file: Path) -> None:
    """Remove a file, but no device such as `/dev/null`."""
    with suppress(OSError):
        if file.is_file():
            file.unlink()


def _pid_file_of_core(port: int | None) -> Path:
    """Return the file in which scripts find the master's pid, such as `~/.ros/roscore-11311.pid`."""
    from pipros.basics.env import DEFAULT_MASTER_PORT, Environment

    return Environment.from_os().ros_home / f"roscore-{port or DEFAULT_MASTER_PORT}.pid"


def report(console: Console, error: Exception) -> int:
    """Print an error as Noetic's roslaunch does, and return the exit code 1.

    The traceback is written to the log file, if there is one.
    """
    import traceback

    from pipros_tools.launch.model import LaunchError

    kind = "RLException" if isinstance(error, LaunchError) else type(error).__name__
    console.error(f"{kind}: {error}")
    if console.record("".join(traceback.format_exception(error)), "ERROR"):
        console.error("The traceback for the exception was written to the log file")
    return 1


def _handle_signals(session: Callable[[], Launching | None]) -> Callable[[], None]:
    """Make SIGINT, SIGTERM and SIGHUP stop the session. Return a function that restores the old handlers.

    Before the session exists, the first signal raises KeyboardInterrupt, and later ones are ignored.
    """
    requested = False

    def handle(_number: int, _frame: object) -> None:
        nonlocal requested
        current = session()
        if current is not None:
            current.request_stop()
        elif not requested:
            requested = True
            raise KeyboardInterrupt

    numbers = {*ENDING_SIGNALS, getattr(signal, "SIGHUP", signal.SIGTERM)}
    before = [(number, signal.signal(number, handle)) for number in numbers]

    def restore() -> None:
        for number, handler in before:
            signal.signal(number, handler)

    return restore


def _session(
    options: Values, files: Sequence[str], arguments: dict[str, str], console: Console, index: PackageIndex
) -> LaunchSession:
    from pipros_tools.launch.session import LaunchSession

    return LaunchSession(files, arguments, session_options(options), console, index=index)


def _child(options: Values, console: Console) -> Child:
    from pipros_tools.launch.child import Child

    return Child(options.child_name, options.server_uri, options.run_id, run_options(options), console)


def _wait_for_master(console: Console) -> None:
    """Block until a master answers.

    If a program accepts connections at the master's address but does not answer, print a message and keep
    waiting, because the program may be a suspended or busy master.
    """
    import time

    from pipros.basics.env import Environment
    from pipros.basics.errors import Unreachable
    from pipros.net.master_client import MasterClient

    uri = Environment.from_os().master_uri
    client = MasterClient(uri, "/roslaunch", timeout_s=_WAIT_ANSWER_S)
    is_announced = is_silent = False
    while True:
        try:
            client.get_pid()
        except Unreachable as error:
            if not is_announced:
                console.say("roscore/master is not yet running, will wait for it to start")
                is_announced = True
            if not is_silent and isinstance(error.__cause__, TimeoutError) and client.addresses:
                is_silent = True
                console.say(f"the port of ROS_MASTER_URI [{uri}] is in use, but no master responds there")
            time.sleep(0.1)
        else:
            console.say("master has started, initiating launch")
            return


def _inspection(options: Values, files: Sequence[str]) -> Inspection | None:
    """Return the function that prints the requested information, or None if no option requests any.

    If there are several such options, the order of precedence is Noetic's.
    """
    requested = (
        options.node_args,
        options.node_list,
        options.find_node,
        options.dump_params,
        options.file_list,
    )
    if not any((*requested, options.ros_args, options.dry_run)):
        return None
    from functools import partial

    from pipros_tools.cli import roslaunch_inspect as inspect

    if options.node_args:
        return partial(inspect.print_node_args, options.node_args, files)
    if options.node_list:
        return inspect.print_nodes
    if options.find_node:
        return partial(inspect.print_file_of_node, options.find_node)
    if options.dump_params:
        return inspect.print_params
    if options.file_list:
        return inspect.print_files
    if options.ros_args:
        return inspect.print_arguments
    return inspect.print_plan


if __name__ == "__main__":
    sys.exit(main())
