"""`rostopic bw`: measures the bandwidth of topics."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from pipros.basics.names import parse_arguments
from pipros_tools.cli.rostopic.window_option import add_window_option, window_of
from pipros_tools.cli.runner import option_parser
from pipros_tools.cli.terminal import LiveBlock, is_terminal
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.measurements import BANDWIDTH_WINDOW, bandwidth_table, bandwidth_text
from pipros_tools.graph.samples import BandwidthWindow

if TYPE_CHECKING:
    from pipros.node.any_msg import AnyMsg

REPORT_PERIOD_S = 1.0


def measure_bandwidth(argv: Sequence[str]) -> int:
    parser = option_parser("rostopic", "bw /topic")
    add_window_option(parser)
    options, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    if not arguments:
        parser.error("topic must be specified")
    # as in Noetic, except that several topics on a terminal are shown as a table
    if len(arguments) > 1 and not is_terminal():
        parser.error("you may only specify one input topic")
    window = window_of(parser, options, BANDWIDTH_WINDOW)
    from pipros_tools.cli.command_node import command_node
    from pipros_tools.graph.listening import Listening, wait_for_topic

    with GraphClient("rostopic") as graph:
        topics = [wait_for_topic(graph.master, graph.resolve(name)).topic for name in arguments]
    windows = {topic: BandwidthWindow(window) for topic in topics}
    lock, block = threading.Lock(), LiveBlock()

    def count(topic: str) -> Callable[[AnyMsg], None]:
        def callback(raw: AnyMsg) -> None:
            with lock:
                windows[topic].add(time.monotonic(), len(raw.body))

        return callback

    def report() -> None:
        now_s = time.monotonic()
        with lock:
            found = {topic: bandwidth.figures(now_s) for topic, bandwidth in windows.items()}
        figures = {topic: figure for topic, figure in found.items() if figure is not None}
        if figures and len(topics) == 1:
            print(bandwidth_text(*figures[topics[0]]), flush=True)
        elif figures:
            block.show(bandwidth_table(figures))

    with command_node("rostopic", argv) as node:
        listening = Listening(node)
        for topic in topics:
            listening.subscribe(topic, count(topic))
            print(f"subscribed to [{topic}]", flush=True)
        while not listening.wait(REPORT_PERIOD_S):
            report()
        report()
    return 0
