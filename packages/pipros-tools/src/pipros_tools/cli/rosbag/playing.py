"""`rosbag play`: publishes the messages in bags at their recorded intervals."""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from math import inf
from optparse import OptionParser, OptionValueError, Values
from typing import Any

from pipros.basics.names import parse_arguments
from pipros.basics.terminals import single_keys
from pipros.msg.time import NS_PER_S
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.options import PlayOptions
from pipros_tools.bag.player import Player, absolute, is_played, opened_bags
from pipros_tools.cli.command_node import command_node
from pipros_tools.cli.entry_point import OutputFailed
from pipros_tools.cli.rosbag.other_bags import add_reading_options, name_beside, opened, warned
from pipros_tools.cli.runner import CommandError, add_flag, option_parser

_SHOW_PERIOD_S = 0.1
_KEY_PERIOD_S = 0.02


def play(argv: Sequence[str]) -> int:
    parser = _parser()
    options, paths = parser.parse_args(list(parse_arguments(argv).rest))
    paths += options.bags
    if not paths:
        parser.error("You must specify at least 1 bag file to play back.")
    chosen = _chosen(parser, options)
    say: Callable[[str], object] = _ignore if options.quiet else _print_line
    try:
        for path in paths:
            say(f"[ INFO] [{time.time():.9f}]: Opening {path}")
        left_out = warned()
        is_requested = partial(is_played, {absolute(topic) for topic in options.topics})
        opener = partial(opened, options=options, left_out=left_out, is_requested=is_requested)
        with opened_bags(paths, opener) as bags, command_node("play", argv, wall_time=True) as node:
            with single_keys() as is_keyboard:
                terminal = _Terminal(is_keyboard=is_keyboard, is_quiet=options.quiet)
                player = Player(node, bags, chosen, terminal, say)
                node.wait_for_master(lambda error: print(f"{error}. Will keep trying", file=sys.stderr))
                if is_keyboard:
                    say("\nHit space to toggle paused, or 's' to step.")
                player.run()
                terminal.finish()
            name_beside(bags)
            if not node.is_shutdown:
                say("\nDone.")
    except (OutputFailed, BrokenPipeError):
        raise
    except OSError as error:
        raise CommandError(f"Error opening file: {error.filename or error}: {error.strerror}") from error
    except BagError as error:
        raise CommandError(str(error)) from error
    return 1 if left_out else 0


def _chosen(parser: OptionParser, options: Values) -> PlayOptions:
    for name in ("rate", "hz"):
        if not 0 < getattr(options, name) < inf:
            parser.error(f"{name} must be greater than zero, got {getattr(options, name)}")
    for name in ("delay", "start", "queue"):
        if not 0 <= getattr(options, name) < inf:
            parser.error(f"{name} must not be less than zero, got {getattr(options, name)}")
    return PlayOptions(
        prefix=options.prefix,
        immediate=options.immediate,
        paused=options.pause,
        queue_size=options.queue,
        clock=options.clock,
        clock_hz=options.hz,
        delay_s=options.delay,
        rate=options.rate,
        start_s=options.start,
        duration_s=options.duration,
        skip_empty_s=options.skip_empty,
        loop=options.loop,
        keep_alive=options.keep_alive,
        topics=options.topics,
        pause_topics=options.pause_topics,
        wait_for_subscribers=options.wait_for_subscribers,
        rate_control_topic=options.rate_control_topic,
        rate_control_delay_s=options.rate_control_max_delay,
    )


def _parser() -> OptionParser:
    parser = option_parser(
        "rosbag", "", "Play back the contents of one or more bag files in a time-synchronized fashion."
    )
    parser.usage = "rosbag play BAGFILE1 [BAGFILE2 BAGFILE3 ...]"

    flag = partial(add_flag, parser)

    def number(*names: str, default: float | None, metavar: str, text: str) -> None:
        parser.add_option(*names, default=default, type="float", metavar=metavar, help=text)

    def several(name: str, text: str) -> None:
        dest = name.lstrip("-").replace("-", "_")
        parser.add_option(name, dest=dest, default=[], action="callback", callback=_collect_words, help=text)

    parser.add_option("-p", "--prefix", default="", metavar="PREFIX", help="prefix all output topics")
    flag("-q", "--quiet", help="suppress console output")
    flag("-i", "--immediate", help="play back all messages without waiting")
    flag("--pause", help="start in paused mode")
    parser.add_option(
        "--queue",
        default=100,
        type="int",
        metavar="SIZE",
        help="use an outgoing queue of size SIZE (defaults to %default)",
    )
    flag("--clock", help="publish the clock time")
    number(
        "--hz",
        default=100.0,
        metavar="HZ",
        text="use a frequency of HZ when publishing clock time (default: 100)",
    )
    number(
        "-d",
        "--delay",
        default=0.2,
        metavar="SEC",
        text="sleep SEC seconds after every advertise call (to allow subscribers to connect)",
    )
    number("-r", "--rate", default=1.0, metavar="FACTOR", text="multiply the publish rate by FACTOR")
    number("-s", "--start", default=0.0, metavar="SEC", text="start SEC seconds into the bag files")
    number("-u", "--duration", default=None, metavar="SEC", text="play only SEC seconds from the bag files")
    number(
        "--skip-empty",
        default=None,
        metavar="SEC",
        text="skip regions in the bag with no messages for more than SEC seconds",
    )
    flag("-l", "--loop", help="loop playback")
    flag(
        "-k",
        "--keep-alive",
        help="keep alive past end of bag (useful for publishing latched topics)",
    )
    flag(
        "--try-future-version",
        help="still try to open a bag file, even if the version number is not known to the player",
    )
    several("--topics", "topics to play back")
    several("--pause-topics", "topics to pause on during playback")
    parser.add_option("--bags", default=[], action="append", help="bags files to play back from")
    flag(
        "--wait-for-subscribers",
        help="wait for at least one subscriber on each topic before publishing",
    )
    parser.add_option(
        "--rate-control-topic",
        default="",
        help="watch the given topic, and if the last publish was more than <rate-control-max-delay> ago, "
        "wait until the topic publishes again to continue playback",
    )
    parser.add_option(
        "--rate-control-max-delay",
        default=1.0,
        type="float",
        help="maximum time difference from <rate-control-topic> before pausing",
    )
    add_reading_options(parser)
    return parser


def _collect_words(option: Any, name: str, _: object, parser: OptionParser) -> None:
    """Consume all words up to the next option as the values of this option."""
    words: list[str] = []
    while parser.rargs and not parser.rargs[0].startswith("-"):
        words.append(parser.rargs.pop(0))
    if not words:
        raise OptionValueError(f"{name} needs at least one topic")
    setattr(parser.values, option.dest, words)


class _Terminal:
    """The keyboard, and the terminal line that shows the playback position."""

    def __init__(self, *, is_keyboard: bool, is_quiet: bool) -> None:
        self._is_keyboard = is_keyboard
        self._is_shown = not is_quiet and sys.stdout.isatty()
        self._next_show = self._next_key = 0.0
        self._has_shown = False

    def key(self) -> str:
        now = time.monotonic()
        if not self._is_keyboard or now < self._next_key:
            return ""
        self._next_key = now + _KEY_PERIOD_S
        descriptor = sys.stdin.fileno()
        if not select.select([descriptor], [], [], 0)[0]:
            return ""
        key = os.read(descriptor, 1)
        self._is_keyboard = bool(key)
        return key.decode("ascii", "ignore")

    def show(self, state: str, bag_ns: int, played_ns: int, whole_ns: int) -> None:
        now = time.monotonic()
        if not self._is_shown or now < self._next_show:
            return
        self._next_show = now + _SHOW_PERIOD_S
        self._has_shown = True
        bag_s, played_s, whole_s = (each / NS_PER_S for each in (bag_ns, played_ns, whole_ns))
        text = f" [{state}]  Bag Time: {bag_s:13.6f}   Duration: {played_s:.6f} / {whole_s:.6f}"
        print(f"{text:<80}", end="\r", flush=True)

    def finish(self) -> None:
        if self._has_shown:
            print()


def _print_line(text: str) -> None:
    print(text, flush=True)


def _ignore(_: str) -> None:
    return
