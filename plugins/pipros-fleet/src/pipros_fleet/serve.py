"""The long-running programs of a fleet: a member's agent, and the router."""

from __future__ import annotations

import ipaddress
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_file
from pipros.basics.interruptible_wait import OnceEvent, set_by_signals
from pipros.node import Node
from pipros.node.program_log import stderr_logger
from pipros.node.start_params import is_on
from pipros_fleet.agent import Agent, agent_node_name, new_instance
from pipros_fleet.fleet_rules import FleetFile
from pipros_fleet.zenoh_connecting import checked_address, connect, open_router
from pipros_fleet.zenoh_session import LinkFailed, SessionLink, Tls

if TYPE_CHECKING:
    from pipros_fleet.history_files import HistoryFiles

RETRY_S: Final = 1.0
_LOGGER: Final = "pipros_fleet"
CHANGES_S: Final = 1.0
"""Interval at which a router checks its list of members for changes."""


_THREADS: Final = "(rx: (worker_threads: 1))"
"""Zenoh's settings for an agent: one receiving thread is enough for its one link. By default, each message
also wakes a second receiving thread, which finds nothing to do.
"""


class OpenToAll(PiprosError):
    """An address without TLS is reachable from a network."""


@dataclass(frozen=True, slots=True)
class HistoryOptions:
    """Settings of a router's recorder.

    Attributes:
        files: the files to write, which are completed when the router stops.
        topics: names, possibly with wildcards, of topics to record even if no member receives them.
    """

    files: HistoryFiles
    topics: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class RouterOptions:
    """Settings of a router.

    Attributes:
        addresses: addresses to listen on, `tcp/HOST:PORT` or `tls/HOST:PORT`.
        others: addresses of routers to connect to.
        tls: certificates; required for addresses with TLS.
        members_file: list of permitted members; if None, everyone may do everything.
        access: function that returns the access rules for the current list of members.
        allows_plain_network: whether addresses without TLS may be reachable from a network.
        history: settings of the recorder; None to record nothing.
    """

    addresses: Sequence[str]
    others: Sequence[str] = ()
    tls: Tls | None = None
    members_file: Path | None = None
    access: Callable[[], dict[str, object]] | None = None
    allows_plain_network: bool = False
    history: HistoryOptions | None = None


def serve_member(node: Node, name: str, router: str, file: FleetFile, tls: Tls | None) -> int:
    """Connect the node's master to a fleet until Ctrl-C, SIGTERM or the node's shutdown.

    Wait for the router and the master first. Return the exit code: 1 if the name is taken or the member
    cannot join, otherwise 0.
    """
    os.environ.setdefault("ZENOH_RUNTIME", _THREADS)
    over = OnceEvent()
    failures: list[PiprosError] = []
    with set_by_signals(over):
        stop = threading.Thread(
            target=_join, args=(node, name, router, file, tls, over, failures), name="fleet", daemon=True
        )
        stop.start()
        over.wait()
        stop.join(_ENDING_S)
    for failure in failures:
        print(f"ERROR: {failure}", file=sys.stderr)
    return 1 if failures else 0


_ENDING_S: Final = 0.4
"""Maximum time that the node, the agent and the link together may take to shut down."""


def _join(
    node: Node,
    name: str,
    router: str,
    file: FleetFile,
    tls: Tls | None,
    over: OnceEvent,
    failures: list[PiprosError],
) -> None:
    def fail(error: PiprosError) -> None:
        failures.append(error)
        over.set()

    link = _connected(router, tls, name, file, over)
    if link is None:
        return
    with node:
        node.on_shutdown(over.set)
        node.wait_for_master(lambda error: print(f"{error}; waiting", file=sys.stderr))
        if is_on(node, "/use_sim_time"):
            print("The master uses simulated time, which stays local.", file=sys.stderr)
        agent = Agent(node, link, name, file, on_failure=fail)
        try:
            agent.start()
            print(f"pipros fleet: [{name}] joined over {router}", flush=True)
            over.wait()
        except PiprosError as error:
            fail(error)
        finally:
            agent.close()
            link.close()


def _connected(
    router: str, tls: Tls | None, name: str, file: FleetFile, over: OnceEvent
) -> SessionLink | None:
    """Connect to the router, retrying until it answers. Return None if the program is stopped first."""
    is_reported = False
    while not over.is_set():
        try:
            return connect(router, tls, asker=name, bandwidth_kbit=file.bandwidth_kbit)
        except LinkFailed as error:
            if not is_reported:
                is_reported = True
                print(f"{error}; waiting", file=sys.stderr, flush=True)
        over.wait(RETRY_S)
    return None


def serve_router(options: RouterOptions) -> int:
    """Run a router until Ctrl-C or SIGTERM.

    The router restarts if its list of members changes, which closes all links. Members that are still listed
    reconnect within about a second.

    Raises:
        OpenToAll: an address without TLS is reachable from a network.
        LinkFailed: the router cannot listen on an address.
    """
    check_addresses(options)
    over = OnceEvent()
    with set_by_signals(over):
        is_first = True
        while not over.is_set():
            before = _stamp(options.members_file)
            with _running_router(options):
                if is_first:
                    print(f"pipros fleet: router at {', '.join(options.addresses)}", flush=True)
                else:
                    print("pipros fleet: the list of members has changed", flush=True)
                is_first = False
                while not over.wait(CHANGES_S) and _stamp(options.members_file) == before:
                    pass
    return 0


def check_addresses(options: RouterOptions) -> None:
    """Check the addresses on which a router will listen.

    Raises:
        OpenToAll: an address without TLS is reachable from a network.
        LinkFailed: an address is malformed, or uses TLS although there are no keys.
    """
    for address in options.addresses:
        checked_address(address)
        if address.startswith("tls/"):
            if options.tls is None:
                raise LinkFailed(
                    f"{address} needs --keys FOLDER, a folder created by `pipros fleet keys create`"
                )
        elif not options.allows_plain_network and not _is_loopback(address):
            raise OpenToAll(
                f"{address} is reachable from a network. Without TLS, everyone there can control all robots; "
                "use `pipros fleet keys` and tls/HOST:PORT, or --without-tls if the network is trusted"
            )


def _is_loopback(address: str) -> bool:
    host = address.partition("/")[2].rpartition(":")[0].strip("[]")
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@contextmanager
def _running_router(options: RouterOptions) -> Iterator[None]:
    access = options.access() if options.access is not None else None
    router = open_router(options.addresses, options.tls, access, others=options.others)
    with closing(router):
        if options.history is None:
            yield
            return
        from pipros_fleet.recorder import FleetRecorder  # imported here, because agents do not need it

        files, topics = options.history.files, options.history.topics
        with closing(
            FleetRecorder(router, files, new_instance(), topics, log=stderr_logger(_LOGGER))
        ) as recorder:
            recorder.start()
            yield


def _stamp(file: Path | None) -> object:
    try:
        return None if file is None else read_file(file)
    except OSError:
        return None


def agent_node(name: str, argv: Sequence[str]) -> Node:
    """Create an agent's node, which logs to standard error."""
    return Node(agent_node_name(name), argv=argv, log=stderr_logger(_LOGGER))
