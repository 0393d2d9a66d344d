"""`rosmaster`: runs only the master, for scripts and Noetic's roslaunch. Users start `roscore` instead."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from optparse import SUPPRESS_HELP, OptionParser, Values
from pathlib import Path

from pipros.basics import names
from pipros.basics.env import DEFAULT_MASTER_PORT, Environment
from pipros.basics.errors import PiprosError
from pipros.basics.interruptible_wait import OnceEvent
from pipros.basics.interrupts import ENDING_SIGNALS
from pipros_tools.cli.entry_point import command

_DEPRECATED = """


ACHTUNG WARNING ACHTUNG WARNING ACHTUNG
WARNING ACHTUNG WARNING ACHTUNG WARNING


Standalone zenmaster has been deprecated, please use 'roscore' instead


ACHTUNG WARNING ACHTUNG WARNING ACHTUNG
WARNING ACHTUNG WARNING ACHTUNG WARNING


"""


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the master until Ctrl-C, SIGTERM or a shutdown request; return the exit code.

    With `--statistics`, print the statistics of a running master instead.
    """
    parsed = names.parse_arguments(sys.argv[1:] if argv is None else argv)
    parser = _parser()
    options, words = parser.parse_args(list(parsed.rest))
    if words:
        parser.error(f"unrecognized arg: {words[0]}")
    try:
        port = DEFAULT_MASTER_PORT if options.port is None else int(options.port)
        timeout_s = None if options.timeout is None else float(options.timeout)
    except ValueError as error:
        parser.error(f"the port must be an integer, and the timeout a number: {error}")
    if not 0 <= port <= 65535:
        parser.error(f"port must be between 0 and 65535, got {port}")
    environment = Environment.from_os()
    if options.statistics:
        return _print_statistics(parsed.special.get("__master") or environment.master_uri)
    if not options.core:
        print(_DEPRECATED)
    environment = environment._replace(
        hostname=parsed.special.get("__hostname") or environment.hostname,
        ip=parsed.special.get("__ip") or environment.ip,
    )
    _log_to(Path(parsed.special.get("__log") or environment.log_dir / "master.log"), options)
    return _serve(environment, port, timeout_s, options)


def _parser() -> OptionParser:
    parser = OptionParser(usage="usage: zenmaster [options]", prog="rosmaster")
    parser.add_option("--core", dest="core", action="store_true", default=False, help="run as core")
    parser.add_option("-p", "--port", dest="port", help="override port", metavar="PORT")
    parser.add_option(
        "-w",
        "--numworkers",
        dest="num_workers",
        type="int",
        default=3,
        help="override number of worker threads",
        metavar="NUM_WORKERS",
    )
    parser.add_option(
        "-t",
        "--timeout",
        dest="timeout",
        help="override the socket connection timeout (in seconds).",
        metavar="TIMEOUT",
    )
    parser.add_option(
        "--master-logger-level",
        dest="master_logger_level",
        default=False,
        type="str",
        help="set rosmaster.master logger level ('debug', 'info', 'warn', 'error', 'fatal')",
    )
    # Old versions of roslaunch and old scripts pass this option. It has no effect.
    parser.add_option("-v", "--verbose", action="store_true", help=SUPPRESS_HELP)
    parser.add_option(
        "--bind", metavar="ADDRESS", help="address to listen on; 0.0.0.0 opens the master to the network"
    )
    parser.add_option(
        "--allow", metavar="NETWORK", action="append", default=[], help="network that may connect; repeatable"
    )
    parser.add_option(
        "--resume",
        metavar="FILE",
        help="keep parameters and registrations in FILE, and start with its contents",
    )
    parser.add_option(
        "--statistics",
        action="store_true",
        default=False,
        help="print the statistics of the master at ROS_MASTER_URI, and exit",
    )
    return parser


def _print_statistics(uri: str) -> int:
    from pipros.master.statistics import METHOD, describe
    from pipros.net.master_client import MasterClient
    from pipros.wire.xmlrpc import Fault

    try:
        print(describe(uri, MasterClient(uri, "/rosmaster", timeout_s=10).call(METHOD)))
    except Fault:
        print(f"ERROR: the master at {uri} is not a pipros master: it has no statistics", file=sys.stderr)
    except (PiprosError, ValueError) as error:
        print(f"ERROR: {error}", file=sys.stderr)
    else:
        return 0
    return 1


def _log_to(file: Path, options: Values) -> None:
    from pipros.master.log import MasterLog

    MasterLog(file, options.master_logger_level or None, loggers=[""])


def _serve(environment: Environment, port: int, timeout_s: float | None, options: Values) -> int:
    from pipros.master.master import Master, tune_for_master
    from pipros.master.options import MasterOptions, limits_with_timeout

    tune_for_master()
    end = OnceEvent()

    def shut_down(reason: str) -> None:
        print(f"shutdown request: {reason}", flush=True)
        end.set()

    for number in ENDING_SIGNALS:
        signal.signal(number, lambda *_: end.set())
    try:
        master_options = MasterOptions(
            host=options.bind,
            port=port,
            allow=options.allow,
            limits=limits_with_timeout(timeout_s),
            store=Path(options.resume) if options.resume else None,
            on_shutdown=shut_down,
        )
        master = Master(master_options, environment=environment)
        master.start()
    except (PiprosError, ValueError) as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        taken = f"port {port} is already in use" if "in use" in str(error) else str(error)
        print(f"ERROR: Unable to start XML-RPC server, {taken}", file=sys.stderr)
        return 1
    with master:
        if not options.core:
            print(f"{master.uri} {master.binding}", flush=True)
        end.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
