"""`rostopic hz`: measures the message rate of topics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from pipros.basics.names import parse_arguments
from pipros_tools.cli.rostopic.window_option import add_window_option, window_of
from pipros_tools.cli.runner import option_parser
from pipros_tools.cli.terminal import LiveBlock
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.measurements import Rates
from pipros_tools.graph.samples import DEFAULT_WINDOW

if TYPE_CHECKING:
    from pipros.node.any_msg import AnyMsg

REPORT_PERIOD_S = 1.0


@dataclass(frozen=True, slots=True)
class HzOptions:
    """The options for measuring rates.

    Attributes:
        window: the number of messages from which each rate is computed.
        expression: a Python expression; only messages for which it is true are counted.
        wall_time: whether to use the machine's clock even if `/use_sim_time` is set.
        tcp_nodelay: whether to ask publishers to send small messages immediately.
    """

    window: int = DEFAULT_WINDOW
    expression: str | None = None
    wall_time: bool = False
    tcp_nodelay: bool = False


def measure_rate(argv: Sequence[str]) -> int:
    names, options = _parse(list(parse_arguments(argv).rest))
    from pipros_tools.cli.command_node import command_node
    from pipros_tools.graph.listening import Listening, wait_for_topic
    from pipros_tools.graph.message_filter import MessageFilter
    from pipros_tools.graph.raw_decoder import RawDecoder

    with GraphClient("rostopic") as graph:
        try:
            names = list(dict.fromkeys(map(graph.resolve, names)))
            topics = [wait_for_topic(graph.master, name).topic for name in names]
        except KeyboardInterrupt:
            return 1  # as in Noetic, fail if there is no topic to subscribe to
    # The report for several topics is a table, which is updated in place on a terminal.
    block = LiveBlock() if len(topics) > 1 else None
    show = block.show if block else partial(print, flush=True)
    rates = Rates(topics, options.window, say=block.say if block else show)
    passes = MessageFilter(options.expression) if options.expression else None
    decoder = RawDecoder()
    with command_node("rostopic", argv, wall_time=options.wall_time) as node:
        listening = Listening(node)
        clock = node.clock

        def count(topic: str) -> Callable[[AnyMsg], None]:
            def callback(raw: AnyMsg) -> None:
                now_ns = clock.now_ns()
                has_begun = now_ns > 0  # a simulated clock is 0 until the first message on /clock
                if has_begun and (passes is None or passes(decoder.decode(raw), topic)):
                    rates.add(topic, now_ns / 1e9)

            return callback

        for topic in topics:
            listening.subscribe(topic, count(topic), tcp_nodelay=options.tcp_nodelay)
            print(f"subscribed to [{topic}]", flush=True)
        while not listening.wait(REPORT_PERIOD_S):
            show(rates.report())
        if rates.has_new():
            show(rates.report())
    return 0


def _parse(argv: list[str]) -> tuple[list[str], HzOptions]:
    parser = option_parser("rostopic", "hz [options] /topic_0 [/topic_1 [topic_2 [..]]]")
    add_window_option(parser)
    parser.add_option(
        "--filter",
        dest="expression",
        metavar="EXPR",
        help="only measure messages matching the specified Python expression",
    )
    parser.add_option(
        "--wall-time",
        dest="wall_time",
        action="store_true",
        default=False,
        help="calculates rate using wall time which can be helpful when clock isn't published"
        " during simulation",
    )
    parser.add_option(
        "--tcpnodelay",
        dest="tcp_nodelay",
        action="store_true",
        default=False,
        help="use the TCP_NODELAY transport hint when subscribing to topics",
    )
    options, arguments = parser.parse_args(argv)
    if not arguments:
        parser.error("topic must be specified")
    window = window_of(parser, options, DEFAULT_WINDOW)
    return arguments, HzOptions(window, options.expression, options.wall_time, options.tcp_nodelay)
