"""`rosnode ping`: does a node answer, and how quickly."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from optparse import OptionParser

from pipros.cli.program import Surroundings, bullets, option_parser
from pipros.cli.rosnode.listing import node_names
from pipros.errors import PiprosError, Refused, Unreachable
from pipros.net.master import MasterClient
from pipros.net.rpc import Fault, RpcClient

TIMEOUT_S = 3.0
PERIOD_S = 1.0


def ping_nodes(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "ping [options] <node>")
    parser.add_option("-a", "--all", dest="all", action="store_true", help="ping all nodes")
    parser.add_option(
        "-c",
        dest="count",
        metavar="COUNT",
        type="int",
        help="number of pings to send. Not available with --all",
    )
    options, arguments = parser.parse_args(list(argv))
    with Surroundings("rosnode") as here:
        if options.all:
            if arguments:
                parser.error(f"Invalid arguments '{', '.join(arguments)}' used with --all")
            if options.count:
                parser.error("-c may not be used with --all")
            ping_all(here.master, print)
            return 0
        if not arguments:
            _list_choices(parser, here.master)
        if len(arguments) > 1:
            parser.error("you may only specify one input node")
        node = here.resolve(arguments[0])
        print(f"rosnode: node is [{node}]")
        ping(here.master, node, count=options.count, say=print)
    return 0


def _list_choices(parser: OptionParser, master: MasterClient) -> None:
    try:
        nodes = node_names(master)
    except PiprosError:  # without a master there is nothing to choose from
        nodes = []
    if nodes:
        choice = "\n".join(nodes)
        parser.print_usage(sys.stderr)
        print(f"rosnode: error: Please enter a node to ping. Available nodes are:\n{choice}", file=sys.stderr)
    parser.error("Please enter a node to ping")


def ping(
    master: MasterClient,
    node: str,
    *,
    count: int | None = 1,
    say: Callable[[str], object] | None = None,
    pause: Callable[[float], object] = time.sleep,
) -> bool:
    """Pings a node once a second, `count` times, or for ever when that is None or 0.

    Ctrl-C ends it, too. Returns False, and tells why on standard error, as soon as a ping is not answered.

    Raises:
        Unreachable: the *master* does not answer.
    """
    pings = _Pings(master, node, say)
    if not pings.find():
        return False
    if say:
        say(f"pinging {node} with a timeout of {TIMEOUT_S}s")
    try:
        while not count or len(pings.durations_ms) < count:
            if pings.durations_ms:
                pause(PERIOD_S)
            if not pings.send():
                return False
    except KeyboardInterrupt:
        pass
    pings.conclude()
    return True


def ping_all(master: MasterClient, say: Callable[[str], object] | None = None) -> tuple[list[str], list[str]]:
    """Pings every node once. Returns the nodes that answered, and those that did not."""
    nodes = node_names(master)
    if say:
        say(bullets("Will ping the following nodes: ", nodes) + "\n")
    answered = [node for node in nodes if ping(master, node, say=say)]
    return answered, [node for node in nodes if node not in answered]


class _Pings:
    """The pings to one node so far."""

    def __init__(self, master: MasterClient, node: str, say: Callable[[str], object] | None) -> None:
        self.durations_ms: list[float] = []
        self._master = master
        self._node = node
        self._say = say
        self._api = ""

    def find(self) -> bool:
        """Asks the master where the node is; False when nowhere."""
        try:
            self._api = self._master.lookup_node(self._node)
        except Refused:
            print(f"cannot ping [{self._node}]: unknown node", file=sys.stderr)
            return False
        return True

    def send(self) -> bool:
        """Pings once; False when there is no answer."""
        start = time.perf_counter()
        try:
            with RpcClient(self._api, timeout_s=TIMEOUT_S) as client:
                client.call("getPid", self._master.caller_id)
        except (Unreachable, ValueError) as error:
            return self._explain(error)
        except Fault:
            pass  # strange, but an answer
        duration_ms = (time.perf_counter() - start) * 1000
        self.durations_ms.append(duration_ms)
        if self._say:
            self._say(f"xmlrpc reply from {self._api}\ttime={duration_ms:f}ms")
        return True

    def _explain(self, error: Unreachable | ValueError) -> bool:
        """Says why there was no answer. True when the node has moved, so that the next ping may succeed."""
        from socket import gaierror

        cause = error.__context__
        if isinstance(cause, ConnectionRefusedError):
            old_api = self._api
            if self.find() and self._api != old_api:
                print(
                    f"node url has changed from [{old_api}] to [{self._api}], retrying to ping",
                    file=sys.stderr,
                )
                return True
            print(f"ERROR: connection refused to [{old_api}]", file=sys.stderr)
        elif isinstance(cause, gaierror):
            host = self._api.partition("://")[2].rpartition(":")[0]
            print(f"ERROR: Unknown host [{host}] for node [{self._node}]", file=sys.stderr)
        elif isinstance(cause, TimeoutError):
            print(f"connection to [{self._node}] timed out", file=sys.stderr)
        else:
            print(f"ERROR: communication with node [{self._node}] failed: {error}", file=sys.stderr)
        return False

    def conclude(self) -> None:
        if self._say and len(self.durations_ms) > 1:
            self._say(f"ping average: {sum(self.durations_ms) / len(self.durations_ms):f}ms")
