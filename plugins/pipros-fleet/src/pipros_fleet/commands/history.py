"""`pipros fleet history`: lists and copies a router's recordings of a member."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.replaced_file import write_whole
from pipros_fleet.commands.options import add_link_options, link_of
from pipros_tools.cli.runner import CommandError, option_parser


def main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet history", "MEMBER [options]")
    add_link_options(parser)
    parser.add_option("--output", metavar="DIR", help="copy the files to this folder, for rosbag or the page")
    parser.add_option(
        "--last",
        metavar="S",
        type="float",
        default=0.0,
        help="only files with messages from the last S seconds of the recording",
    )
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) != 1:
        parser.error("exactly one member name is required")
    from pipros_fleet.keys import member_name
    from pipros_fleet.status import history_file, history_of

    member = member_name(arguments[0])
    with link_of(options) as link:
        files = history_of(link, member)
        if files is None:
            raise CommandError(
                "no router of the fleet keeps a history; start one with `pipros fleet router --history DIR`"
            )
        end_ns = files[-1].end_ns if files else 0
        shown = [each for each in files if not options.last or each.end_ns >= end_ns - options.last * 1e9]
        if not shown:
            raise CommandError(f"there is no history of [{member}]")
        for file in shown:
            begin, end = (_text(each) for each in (file.begin_ns, file.end_ns))
            print(f"{file.name}: {begin} to {end}, {file.messages} messages, {file.bytes / 1e6:.1f} MB")
            if options.output is not None:
                _write(Path(options.output, f"{member}_{file.name}"), history_file(link, member, file.name))
    return 0


def _text(time_ns: int) -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(time_ns / 1e9))


def _write(path: Path, content: bytes | None) -> None:
    if content is None:
        raise CommandError(f"the router can no longer send the file for {path}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content)
    except OSError as error:
        raise CommandError(f"cannot write {path}: {error.strerror or error}") from None
