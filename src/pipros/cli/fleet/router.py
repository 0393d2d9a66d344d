"""`pipros fleet router`: runs a router."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.cli.fleet.options import ROUTER
from pipros.cli.runner import add_flag, option_parser


def main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet router", "[ADDRESS…] [options]")
    parser.add_option(
        "--keys",
        metavar="FOLDER",
        help="the folder of `pipros fleet keys create`: TLS, for listed members only",
    )
    parser.add_option(
        "--connect", metavar="ADDRESS", action="append", help="another router to connect to; may be repeated"
    )
    add_flag(parser, "--without-tls", help="listen on a network without TLS; everyone on it is trusted")
    options, arguments = parser.parse_args(list(argv))
    from pipros.fleet.serve import RouterOptions, serve_router

    addresses = arguments or [ROUTER]
    others = options.connect or []
    if options.keys is None:
        return serve_router(RouterOptions(addresses, others, allows_plain_network=bool(options.without_tls)))
    from pipros.fleet.certificates import Authority

    authority = Authority(options.keys)
    return serve_router(
        RouterOptions(addresses, others, authority.router_tls(), authority.members_file, authority.access)
    )
