"""`rostopic hz`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipros.cli.program import Surroundings, option_parser
from pipros.cli.rostopic.samples import DEFAULT_WINDOW, Figures, Rate
from pipros.names import parse_arguments

if TYPE_CHECKING:
    from pipros.node.raw import RawMessage

REPORT_PERIOD_S = 1.0
NO_NEWS = "no new messages"


@dataclass(frozen=True, slots=True)
class HzOptions:
    """How rates are measured.

    Attributes:
        window: how many messages count.
        expression: measure only messages for which it is true.
        wall_time: by the machine's clock also when the system's time is simulated.
        tcp_nodelay: ask publishers to send each message at once.
    """

    window: int = DEFAULT_WINDOW
    expression: str | None = None
    wall_time: bool = False
    tcp_nodelay: bool = False


def measure_rate(argv: Sequence[str]) -> int:
    names, options = _parse(list(parse_arguments(argv).rest))
    from pipros.cli.command_node import command_node
    from pipros.cli.rostopic.filters import MessageFilter
    from pipros.cli.rostopic.listening import Listening, wait_for_source
    from pipros.cli.rostopic.raw import MessageClasses

    with Surroundings("rostopic") as here:
        topics = [wait_for_source(here.master, here.resolve(name)).topic for name in names]
    rates = Rates(topics, options.window)
    passes = MessageFilter(options.expression) if options.expression else None
    classes = MessageClasses()
    with command_node("rostopic", argv, wall_time=options.wall_time) as node:
        listening = Listening(node)
        clock = node.clock

        def count(topic: str) -> Callable[[RawMessage], None]:
            def callback(raw: RawMessage) -> None:
                now_ns = clock.now_ns()
                has_begun = now_ns > 0  # a simulated clock stands at 0 until its first message
                if has_begun and (passes is None or passes(classes.decode(raw), topic)):
                    rates.add(topic, now_ns / 1e9)

            return callback

        for topic in topics:
            listening.subscribe(topic, count(topic), tcp_nodelay=options.tcp_nodelay)
            print(f"subscribed to [{topic}]", flush=True)
        try:
            while not listening.wait(REPORT_PERIOD_S):
                print(rates.report(), flush=True)
        except KeyboardInterrupt:
            if rates.has_news():
                print(rates.report())
    return 0


def _parse(argv: list[str]) -> tuple[list[str], HzOptions]:
    parser = option_parser("rostopic", "hz [options] /topic_0 [/topic_1 [topic_2 [..]]]")
    parser.add_option(
        "-w",
        "--window",
        dest="window",
        metavar="WINDOW",
        help="window size, in # of messages, for calculating rate",
    )
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
    try:
        window = DEFAULT_WINDOW if options.window is None else int(options.window)
    except ValueError:
        parser.error("window size must be an integer")
    return arguments, HzOptions(window, options.expression, options.wall_time, options.tcp_nodelay)


class Rates:
    """The rates of several topics. Messages are counted in any thread."""

    def __init__(self, topics: Sequence[str], window: int = DEFAULT_WINDOW) -> None:
        self._topics = tuple(topics)
        self._rates = {topic: Rate(window) for topic in topics}
        self._lock = threading.Lock()

    def add(self, topic: str, moment_s: float) -> None:
        with self._lock:
            if not self._rates[topic].add(moment_s):
                print("time has reset, resetting counters", flush=True)

    def has_news(self) -> bool:
        with self._lock:
            return any(rate.has_news for rate in self._rates.values())

    def report(self) -> str:
        """The lines that are printed once a second."""
        with self._lock:
            news = {topic: rate.figures() for topic, rate in self._rates.items() if rate.has_news}
        figures = {topic: found for topic, found in news.items() if found is not None}
        if not figures:
            return NO_NEWS
        if len(self._topics) == 1:
            return describe(figures[self._topics[0]])
        return table(figures)


def describe(figures: Figures) -> str:
    """The figures of a single topic."""
    return (
        f"average rate: {_rate(figures):.3f}\n"
        f"\tmin: {figures.minimum:.3f}s max: {figures.maximum:.3f}s"
        f" std dev: {figures.deviation:.5f}s window: {figures.count}"
    )


def table(figures: Mapping[str, Figures]) -> str:
    """The figures of several topics, four digits each, below one another."""
    columns = [["topic"], ["rate"], ["min_delta"], ["max_delta"], ["std_dev"], ["window"]]
    for topic, found in figures.items():
        numbers = (_rate(found), found.minimum, found.maximum, found.deviation)
        cells = [topic, *(str(float(f"{number:.4g}")) for number in numbers), str(found.count)]
        for column, cell in zip(columns, cells, strict=True):
            column.append(cell)
    widths = [max(map(len, column)) for column in columns]
    heading = "   ".join(column[0].center(width) for column, width in zip(columns, widths, strict=True))
    rows = [
        "   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        for row in list(zip(*columns, strict=True))[1:]
    ]
    return "\n".join([heading, "=" * len(heading), *rows, ""])


def _rate(figures: Figures) -> float:
    return 1.0 / figures.mean if figures.mean > 0 else 0.0
