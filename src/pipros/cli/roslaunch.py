"""`roslaunch`: starts what launch files describe, or tells about it."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from optparse import OptionParser, Values
from pathlib import Path
from typing import TYPE_CHECKING

from pipros import names
from pipros.errors import PiprosError
from pipros.launch.console import Console
from pipros.launch.files import NoSuchFiles, resolve_files
from pipros.launch.model import Output
from pipros.workspace.index import PackageIndex

if TYPE_CHECKING:
    from pipros.launch.session import Session, SessionOptions

USAGE = (
    "usage: %prog [options] [package] <filename> [arg_name:=value...]\n"
    "       %prog [options] <filename> [<filename>...] [arg_name:=value...]\n\n"
    "If <filename> is a single dash ('-'), launch XML is read from standard input."
)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code."""
    parser = _parser()
    options, words = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    arguments, words = split_arguments(words)
    console = Console(has_title=not options.disable_title, is_verbose=options.verbose)
    if options.child_name or options.server_uri:
        parser.error(
            "--child is for the far side of Noetic's roslaunch; pipros starts remote nodes by ssh alone"
        )
    if not words and not options.core:
        parser.error("you must specify at least one input file")
    index = PackageIndex.from_environment()
    try:
        files = resolve_files(words, index)
    except NoSuchFiles as error:
        parser.error(error.reason)
    except PiprosError as error:
        return report(console, error)
    inspect = _inspection(options)
    if inspect is not None:
        return inspect(files, arguments, index)
    return run(lambda: _session(options, files, arguments, console, index), console, options)


def split_arguments(words: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """`name:=value` apart from everything else; values may be empty here, unlike in remappings."""
    arguments: dict[str, str] = {}
    rest = []
    for word in words:
        if names.is_remapping_argument(word):
            name, _, value = word.partition(":=")
            arguments[name.strip()] = value.strip()
        else:
            rest.append(word)
    return arguments, rest


def run(make_session: Callable[[], Session], console: Console, options: Values) -> int:
    """Starts a session, waits for its end, and cleans up, whatever happens in between."""
    if options.wait:
        with suppress(KeyboardInterrupt):
            _wait_for_master(console)
    pid_file = Path(options.pid_fn) if options.pid_fn else None
    session: Session | None = None
    code = 0
    stop_handling = _handle_signals(lambda: session)
    try:
        if pid_file is not None:
            import os

            pid_file.write_text(str(os.getpid()))
        session = make_session()
        session.start()
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
                pid_file.unlink(missing_ok=True)
    return code


def report(console: Console, error: Exception) -> int:
    """Prints an error as Noetic's roslaunch does; the exit code that goes with it."""
    from pipros.launch.model import LaunchError

    kind = "RLException" if isinstance(error, LaunchError) else type(error).__name__
    console.error(f"{kind}: {error}")
    console.error("The traceback for the exception was written to the log file")
    if console.has_log:
        import traceback

        console.record("".join(traceback.format_exception(error)), "ERROR")
    return 1


def _handle_signals(session: Callable[[], Session | None]) -> Callable[[], None]:
    """Lets Ctrl-C and its like end the session in order. Returns what restores the handlers of before.

    While a session is only coming up, KeyboardInterrupt ends that.
    """
    requested = False

    def handle(_number: int, _frame: object) -> None:
        nonlocal requested
        current = session()
        if current is not None and current.is_started:
            current.request_stop()
        elif not requested:
            requested = True
            raise KeyboardInterrupt

    numbers = [signal.SIGINT, signal.SIGTERM]
    if hasattr(signal, "SIGHUP"):
        numbers.append(signal.SIGHUP)
    before = [(number, signal.signal(number, handle)) for number in numbers]

    def restore() -> None:
        for number, handler in before:
            signal.signal(number, handler)

    return restore


def _session(
    options: Values, files: Sequence[str], arguments: dict[str, str], console: Console, index: PackageIndex
) -> Session:
    from pipros.launch.session import Session

    return Session(files, arguments, session_options(options), console, index=index)


def session_options(options: Values) -> SessionOptions:
    """What the command line of roslaunch or roscore asks for.

    Raises:
        LaunchError: for a timeout that is not positive.
    """
    from pipros.launch import labels
    from pipros.launch.ending import SIGINT_TIMEOUT_S, SIGTERM_TIMEOUT_S
    from pipros.launch.run import RunOptions
    from pipros.launch.session import SessionOptions

    output = Output.SCREEN if options.force_screen else Output.LOG if options.force_log else None
    sigint, sigterm = options.sigint_timeout, options.sigterm_timeout
    return SessionOptions(
        is_core=options.core,
        port=options.port,
        bind=getattr(options, "bind", None),
        allow=tuple(getattr(options, "allow", None) or ()),
        store=_store(options),
        notice_timeout_s=options.timeout,
        run_id=options.run_id,
        has_summary=not options.no_summary,
        checks_log_folder=not options.skip_log_check,
        run=RunOptions(
            output=output,
            all_required=options.force_required,
            local_only=options.local_only,
            has_labels=not getattr(options, "raw_output", True) and labels.are_wanted(),
            sigint_timeout_s=SIGINT_TIMEOUT_S if sigint is None else sigint,
            sigterm_timeout_s=SIGTERM_TIMEOUT_S if sigterm is None else sigterm,
        ),
    )


def _store(options: Values) -> Path | None:
    """The file in which `roscore --resume` keeps what it knows: one for each port."""
    if not getattr(options, "resume", False):
        return None
    from pipros.env import DEFAULT_MASTER_PORT, Environment

    home = Environment.from_os().ros_home.expanduser()
    return home / "pipros" / f"master-{options.port or DEFAULT_MASTER_PORT}.sqlite"


def _wait_for_master(console: Console) -> None:
    """Returns when a master answers."""
    import time

    from pipros.env import Environment
    from pipros.errors import Unreachable
    from pipros.net.master import MasterClient

    client = MasterClient(Environment.from_os().master_uri, "/roslaunch", timeout_s=5.0)
    is_announced = False
    while True:
        try:
            client.get_pid()
        except Unreachable:
            if not is_announced:
                console.say("roscore/master is not yet running, will wait for it to start")
                is_announced = True
            time.sleep(0.1)
        else:
            return


def _inspection(options: Values) -> Callable[[Sequence[str], dict[str, str], PackageIndex], int] | None:
    """What to print instead of starting anything; the first wish in Noetic's order wins."""
    from functools import partial

    from pipros.cli import roslaunch_inspect as inspect

    if options.node_args:
        return partial(inspect.print_node_args, options.node_args)
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
    if options.dry_run:
        return inspect.print_plan
    return None


def _parser() -> OptionParser:
    parser = OptionParser(usage=USAGE, prog="roslaunch")
    add = parser.add_option
    add(
        "--files",
        dest="file_list",
        action="store_true",
        default=False,
        help="Print list files loaded by launch file, including launch file itself",
    )
    add("--args", dest="node_args", metavar="NODE_NAME", help="Print command-line arguments for node")
    add(
        "--nodes",
        dest="node_list",
        action="store_true",
        default=False,
        help="Print list of node names in launch file",
    )
    add("--find-node", dest="find_node", metavar="NODE_NAME", help="Find launch file that node is defined in")
    add(
        "-c",
        "--child",
        dest="child_name",
        metavar="NAME",
        help="Run as child service 'NAME'. Required with -u",
    )
    add("--local", dest="local_only", action="store_true", default=False, help="Do not launch remote nodes")
    add(
        "--screen",
        dest="force_screen",
        action="store_true",
        default=False,
        help="Force output of all local nodes to screen",
    )
    add(
        "--required",
        dest="force_required",
        action="store_true",
        default=False,
        help="Force all nodes to be required",
    )
    add(
        "--log",
        dest="force_log",
        action="store_true",
        default=False,
        help="Force output of all local nodes to log",
    )
    add("-u", "--server_uri", dest="server_uri", metavar="URI", help="URI of server. Required with -c")
    add("--run_id", dest="run_id", metavar="RUN_ID", help="run_id of session. Required with -c")
    add("--wait", action="store_true", default=False, help="wait for master to start before launching")
    add("--core", action="store_true", default=False, help="Launch core services only")
    add_core_options(parser)
    add("--no-summary", dest="no_summary", action="store_true", default=False, help="hide summary printing")
    add(
        "--dump-params",
        dest="dump_params",
        action="store_true",
        default=False,
        help="Dump parameters of all roslaunch files to stdout",
    )
    add(
        "--skip-log-check",
        dest="skip_log_check",
        action="store_true",
        default=False,
        help="skip check size of log folder",
    )
    add(
        "--ros-args",
        dest="ros_args",
        action="store_true",
        default=False,
        help="Display command-line arguments for this launch file",
    )
    add(
        "--disable-title",
        dest="disable_title",
        action="store_true",
        default=False,
        help="Disable setting of terminal title",
    )
    add(
        "--dry-run",
        dest="dry_run",
        action="store_true",
        default=False,
        help="Print what would be set and started, and start nothing",
    )
    add(
        "--raw-output",
        dest="raw_output",
        action="store_true",
        default=False,
        help="Let nodes write to the terminal themselves, without their names before each line",
    )
    return parser  # fmt: skip


def add_core_options(parser: OptionParser) -> None:
    """The options that roslaunch and roscore share."""
    add = parser.add_option
    add(
        "-p",
        "--port",
        dest="port",
        type="int",
        metavar="PORT",
        help="master port. Only valid if master is launched",
    )
    add("--pid", dest="pid_fn", metavar="PID_FN", default="", help="write the roslaunch pid to filename")
    add("-v", dest="verbose", action="store_true", default=False, help="verbose printing")
    add(
        "-w",
        "--numworkers",
        dest="num_workers",
        type="int",
        metavar="NUM_WORKERS",
        help="override number of worker threads. Only valid for core services.",
    )
    add(
        "-t",
        "--timeout",
        dest="timeout",
        type="float",
        metavar="TIMEOUT",
        help="override the socket connection timeout (in seconds). Only valid for core services.",
    )
    add(
        "--master-logger-level",
        dest="master_logger_level",
        metavar="MASTER_LOGGER_LEVEL",
        help="set rosmaster.master logger level ('debug', 'info', 'warn', 'error', 'fatal')",
    )
    add(
        "--sigint-timeout",
        dest="sigint_timeout",
        type="float",
        metavar="SIGINT_TIMEOUT",
        help="the SIGINT timeout used when killing nodes (in seconds).",
    )
    add(
        "--sigterm-timeout",
        dest="sigterm_timeout",
        type="float",
        metavar="SIGTERM_TIMEOUT",
        help="the SIGTERM timeout used when killing nodes if SIGINT does not stop the node (in seconds).",
    )


if __name__ == "__main__":
    sys.exit(main())
