"""`rosbag record`: records topics to bags."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from optparse import OptionParser, Values

from pipros.basics.extras import install_command
from pipros.basics.file_names import is_device
from pipros.basics.names import canonicalize, is_legal, parse_arguments
from pipros.basics.printable import printable
from pipros.basics.windows import ON_WINDOWS
from pipros_tools.bag.compression import BZ2, LZ4, NONE, has_lz4
from pipros_tools.bag.options import FileOptions, RecordOptions
from pipros_tools.bag.recorder import Recorder
from pipros_tools.cli.command_node import command_node
from pipros_tools.cli.rosbag.quantities import bytes_of, seconds_of
from pipros_tools.cli.runner import CommandError, add_flag, option_parser

_MIB = 1024 * 1024


def record(argv: Sequence[str]) -> int:
    parser = _parser()
    options, topics = parser.parse_args(list(parse_arguments(argv).rest))
    topics += options.topics
    _check(parser, options, topics)
    if options.compression == LZ4 and not has_lz4():
        raise CommandError(
            f"writing lz4 needs the lz4 library, which is not installed. Try: {install_command('lz4')}"
        )
    chosen = RecordOptions(
        topics=topics,
        all=options.all,
        is_regex=options.regex,
        exclude=options.exclude or "",
        of_node=options.node or "",
        limit=options.num or 0,
        buffer_bytes=options.buffsize * _MIB,
        min_space_bytes=_bytes(parser, options.min_space),
        tcp_nodelay=options.tcpnodelay,
        publish=options.publish,
        snapshot=options.snapshot,
        files=FileOptions(
            prefix=options.prefix or "",
            name=options.name or "",
            split=options.split,
            max_splits=options.max_splits or 0,
            size_bytes=(options.size or 0) * _MIB,
            duration_s=_seconds(parser, options.duration),
            compression=options.compression,
            chunk_bytes=options.chunksize * 1024,
            repeat_latched=options.repeat_latched,
        ),
    )
    with command_node("record", argv, insist=False) as node:
        say: Callable[[str], object] = _ignore if options.quiet else _info
        if options.udp:
            _warn("UDPROS is not supported; topics are recorded over TCPROS")
        if options.compression == BZ2 and (options.name or "").endswith(".mcap"):
            _warn(f"MCAP does not support {BZ2}; {options.name} is compressed with zstd")
        try:
            is_complete = Recorder(node, chosen, say=say, warn=_warn).run()
        except OSError as error:
            raise CommandError(f"cannot record to '{error.filename}': {error.strerror}") from error
    return 0 if is_complete else 1


def _parser() -> OptionParser:
    parser = option_parser("rosbag", "", "Record a bag file with the contents of specified topics.")
    parser.usage = "rosbag record TOPIC1 [TOPIC2 TOPIC3 ...]"
    add, flag = parser.add_option, partial(add_flag, parser)
    number = partial(add, type="int")
    flag("-a", "--all", help="record all topics")
    flag("-e", "--regex", help="match topics using regular expressions")
    flag("-p", "--publish", help="publish a msg when the record begin")
    exclude = "exclude topics matching the follow regular expression (subtracts from -a or regex)"
    add("-x", "--exclude", metavar="EXCLUDE_REGEX", help=exclude)
    flag("-q", "--quiet", help="suppress console output")
    prefix = "prepend PREFIX to beginning of bag name (name will always end with date stamp)"
    add("-o", "--output-prefix", dest="prefix", metavar="PREFIX", help=prefix)
    add("-O", "--output-name", dest="name", metavar="NAME", help="record to bag with name NAME.bag")
    flag("--split", help="split the bag when maximum size or duration is reached")
    max_splits = (
        "Keep a maximum of N bag files, when reaching the maximum erase the oldest one to keep a constant"
        " number of files."
    )
    number("--max-splits", metavar="MAX_SPLITS", help=max_splits)
    number("--size", metavar="SIZE", help="record a bag of maximum size SIZE MB. (Default: infinite)")
    duration = "record a bag of maximum duration DURATION in seconds, unless 'm', or 'h' is appended."
    add("--duration", metavar="DURATION", help=duration)
    buffsize = "use an internal buffer of SIZE MB (Default: %default, 0 = infinite)"
    number("-b", "--buffsize", default=256, metavar="SIZE", help=buffsize)
    chunksize = "Advanced. Record to chunks of SIZE KB (Default: %default)"
    number("--chunksize", default=768, metavar="SIZE", help=chunksize)
    number("-l", "--limit", dest="num", metavar="NUM", help="only record NUM messages on each topic")
    min_space = "minimum allowed space on the recording device (use G, M, k; default: %default)"
    add("-L", "--min-space", default="1G", metavar="SPACE", help=min_space)
    add("--topic", dest="topics", action="append", default=[], metavar="TOPIC", help="topic to record")
    add("--node", metavar="NODE", help="record all topics subscribed to by a specific node")
    compression = partial(add, dest="compression", default=NONE, action="store_const")
    compression("-j", "--bz2", const=BZ2, help="use BZ2 compression")
    compression("--lz4", const=LZ4, help="use LZ4 compression")
    flag("--tcpnodelay", help="Use the TCP_NODELAY transport hint when subscribing to topics.")
    flag("--udp", help="Use the UDP transport hint when subscribing to topics.")
    flag("--repeat-latched", help="Repeat latched msgs at the start of each new bag file.")
    snapshot = (
        "keep the last messages in memory, and write them to a file when a std_msgs/Empty arrives on"
        " snapshot_trigger or the service ~trigger_snapshot is called. --buffsize and --duration limit what"
        " is kept."
    )
    flag("--snapshot", help=snapshot)
    return parser


def _check(parser: OptionParser, options: Values, topics: Sequence[str]) -> None:
    if not topics and not options.all and not options.node:
        parser.error("You must specify a topic name or else use the '-a' option.")
    for topic in () if options.regex else topics:
        if (canonical := canonicalize(topic)) in ("", "/") or not is_legal(canonical):
            raise CommandError(f"invalid topic name: [{printable(topic)}]")
    if options.prefix and options.name:
        parser.error("Can't set both prefix and name.")
    if ON_WINDOWS and is_device(os.path.basename(options.name or options.prefix or "")):
        parser.error(
            f"{options.name or options.prefix} is the name of a device on Windows; choose another one"
        )
    if options.split and not options.size and not options.duration:
        parser.error("Split specified without giving a maximum duration or size")
    if options.snapshot and (options.split or options.size or options.num):
        parser.error("--snapshot cannot be combined with --split, --size or --limit")
    if options.max_splits is not None and not options.split:
        parser.error("--max-splits needs --split")
    for name in ("max_splits", "size", "num", "buffsize", "chunksize"):
        if (getattr(options, name) or 0) < 0:  # 0 is no limit, as launch files pass it
            option = "limit" if name == "num" else name.replace("_", "-")
            parser.error(f"--{option} must not be less than zero, got {getattr(options, name)}")
    if options.num and not topics:
        raise CommandError("--limit needs the names of topics; with -a or --node, there is none")
    _seconds(parser, options.duration)


def _seconds(parser: OptionParser, text: str | None) -> float:
    if text is None:
        return 0.0
    try:
        return seconds_of(text)
    except ValueError as error:
        parser.error(str(error))


def _bytes(parser: OptionParser, text: str) -> int:
    try:
        return bytes_of(text, "the minimum space")
    except ValueError as error:
        parser.error(str(error))


def _info(text: str) -> None:
    print(f"[ INFO] [{time.time():.9f}]: {text}", flush=True)


def _warn(text: str) -> None:
    print(f"[ WARN] [{time.time():.9f}]: {text}", file=sys.stderr, flush=True)


def _ignore(_: str) -> None:
    return
