"""`rostopic delay`: measures the age of messages on arrival, by the timestamp in their header."""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipros.basics.names import parse_arguments
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.measurements import delay_text
from pipros_tools.graph.samples import DEFAULT_WINDOW, Samples

if TYPE_CHECKING:
    from pipros.node.any_msg import AnyMsg

REPORT_PERIOD_S = 1.0


def measure_delay(argv: Sequence[str]) -> int:
    from argparse import ArgumentParser

    # Noetic uses argparse only for this subcommand, so its help and errors look different.
    parser = ArgumentParser(prog="rostopic", usage="rostopic delay [options] /topic")
    parser.add_argument("topic", help="topic name to be calcurated the delay")
    parser.add_argument(
        "-w",
        "--window",
        dest="window_size",
        default=DEFAULT_WINDOW,
        type=int,
        help="window size, in # of messages, for calculating rate",
    )
    parser.add_argument(
        "--tcpnodelay",
        dest="tcp_nodelay",
        action="store_true",
        help="use the TCP_NODELAY transport hint when subscribing to topics",
    )
    options = parser.parse_args(list(parse_arguments(argv).rest))
    from pipros_tools.cli.command_node import command_node
    from pipros_tools.graph.listening import Listening, wait_for_topic

    with GraphClient("rostopic") as graph:
        topic = wait_for_topic(graph.master, graph.resolve(options.topic)).topic
    with command_node("rostopic", argv) as node:
        listening = Listening(node)
        delays = Delays(options.window_size if options.window_size > 0 else DEFAULT_WINDOW)
        clock = node.clock
        listening.subscribe(
            topic, lambda raw: delays.add(raw, clock.now_ns()), tcp_nodelay=options.tcp_nodelay
        )
        print(f"subscribed to [{topic}]", flush=True)
        while not listening.wait(REPORT_PERIOD_S):
            delays.report()
        delays.report()
    return 0


class Delays:
    """Delays of the last messages. Thread-safe. `report` prints statistics if there are new delays."""

    def __init__(self, window: int = DEFAULT_WINDOW) -> None:
        from pipros_tools.graph.raw_decoder import RawDecoder

        self._decoder = RawDecoder()
        self._delays_s = Samples(window)
        self._lock = threading.Lock()
        self._has_new = False
        self._has_warned = False

    def add(self, raw: AnyMsg, now_ns: int) -> None:
        """Count a message that arrived at `now_ns`. Print an error for the first message without a header."""
        from pipros.msg.time import Time

        message = self._decoder.decode(raw)
        # The publisher's definition of std_msgs/Header may have other fields.
        stamp = getattr(message.header, "stamp", None) if message._has_header else None
        if not isinstance(stamp, Time):
            if not self._has_warned:
                self._has_warned = True
                print(f"[ERROR] [{now_ns / 1e9:.6f}]: msg does not have header", file=sys.stderr, flush=True)
            return
        with self._lock:
            self._delays_s.add((now_ns - stamp.to_nsec()) / 1e9)
            self._has_new = True

    def report(self) -> None:
        with self._lock:
            has_new, self._has_new = self._has_new, False
            figures = self._delays_s.figures()
        if has_new and figures is not None and figures.count > 1:
            print(delay_text(figures), flush=True)
