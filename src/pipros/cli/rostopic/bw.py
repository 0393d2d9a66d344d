"""`rostopic bw`."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipros.cli.program import option_parser, single_argument
from pipros.cli.rostopic.window_option import add_window_option, window_of
from pipros.graph.client import GraphClient
from pipros.graph.measurements import BANDWIDTH_WINDOW, bandwidth_text
from pipros.graph.samples import BandwidthWindow
from pipros.names import parse_arguments

if TYPE_CHECKING:
    from pipros.node.any_msg import RawMessage

REPORT_PERIOD_S = 1.0


def measure_bandwidth(argv: Sequence[str]) -> int:
    parser = option_parser("rostopic", "bw /topic")
    add_window_option(parser)
    options, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    name = single_argument(
        parser,
        arguments,
        missing="topic must be specified",
        several="you may only specify one input topic",
    )
    window = window_of(parser, options, BANDWIDTH_WINDOW)
    from pipros.cli.command_node import command_node
    from pipros.graph.listening import Listening, wait_for_topic

    with GraphClient("rostopic") as graph:
        topic = wait_for_topic(graph.master, graph.resolve(name)).topic
    bandwidth, lock = BandwidthWindow(window), threading.Lock()

    def count(raw: RawMessage) -> None:
        with lock:
            bandwidth.add(time.monotonic(), len(raw.body))

    def report() -> None:
        with lock:
            figures = bandwidth.figures(time.monotonic())
        if figures is not None:
            print(bandwidth_text(*figures), flush=True)

    with command_node("rostopic", argv) as node:
        listening = Listening(node)
        listening.subscribe(topic, count)
        print(f"subscribed to [{topic}]", flush=True)
        while not listening.wait(REPORT_PERIOD_S):
            report()
        report()
    return 0
