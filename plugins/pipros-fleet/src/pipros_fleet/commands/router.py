"""`pipros fleet router`: runs a fleet's router."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipros_fleet.commands.options import ROUTER
from pipros_tools.cli.runner import CommandError, add_flag, option_parser

if TYPE_CHECKING:
    from pipros_fleet.serve import HistoryOptions


def main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet router", "[ADDRESS…] [options]")
    parser.add_option(
        "--keys",
        metavar="FOLDER",
        help="use TLS, with the folder made by `pipros fleet keys create`; only listed members may connect",
    )
    parser.add_option(
        "--connect", metavar="ADDRESS", action="append", help="another router to connect to; may be repeated"
    )
    add_flag(parser, "--without-tls", help="listen on a network without TLS; everyone on it is trusted")
    parser.add_option("--history", metavar="DIR", help="record the members' messages in MCAP files")
    parser.add_option(
        "--history-mb", metavar="N", type="int", default=1000, help="maximum total size of these files (1000)"
    )
    parser.add_option(
        "--history-topic",
        metavar="NAME",
        action="append",
        help="a topic to record even if no member receives it, such as /odom or /camera/*; may be repeated",
    )
    options, arguments = parser.parse_args(list(argv))
    history = _history_of(options)
    from pipros_fleet.serve import RouterOptions, serve_router

    addresses = arguments or [ROUTER]
    others = options.connect or []
    if options.keys is None:
        return serve_router(
            RouterOptions(addresses, others, allows_plain_network=bool(options.without_tls), history=history)
        )
    from pipros_fleet.certificates import Authority

    authority = Authority(options.keys)
    return serve_router(
        RouterOptions(
            addresses,
            others,
            authority.router_tls(),
            authority.members_file,
            authority.access,
            history=history,
        )
    )


def _history_of(options: Any) -> HistoryOptions | None:
    topics = options.history_topic or []
    if options.history is None:
        if topics:
            raise CommandError("--history-topic needs --history DIR")
        return None
    from pipros_fleet.history_files import SMALLEST_LIMIT_BYTES, HistoryFiles
    from pipros_fleet.serve import HistoryOptions

    smallest_mb = -(-SMALLEST_LIMIT_BYTES // 1_000_000)
    if options.history_mb < smallest_mb:
        raise CommandError(f"--history-mb must be >= {smallest_mb}, got {options.history_mb}")
    try:
        return HistoryOptions(HistoryFiles(options.history, options.history_mb * 1_000_000), topics)
    except OSError as error:
        raise CommandError(f"cannot record in {options.history}: {error.strerror or error}") from None
