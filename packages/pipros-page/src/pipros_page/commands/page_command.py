"""Shared parts of all page commands: their options, and the server that runs until Ctrl-C."""

from __future__ import annotations

from ipaddress import ip_address
from math import inf
from optparse import OptionParser
from pathlib import Path
from typing import Any

from pipros_tools.cli.runner import CommandError, add_flag, option_parser
from pipros_tools.cli.server_options import add_address_options, bind_address, policy_of


def page_parser(name: str, usage: str) -> OptionParser:
    """Return a parser with the options shared by all page commands."""
    parser = option_parser(name, usage)
    add_address_options(parser)
    add_flag(parser, "--control", help="let the page change the system")
    parser.add_option(
        "--policy", metavar="FILE", help="policy that limits what the page may change (docs/guides/policy.md)"
    )
    parser.add_option(
        "--token-file", metavar="FILE", help="file with one token per line, to use instead of a new token"
    )
    add_flag(parser, "--read-only", help="do not let the page change the system")
    parser.add_option("--bags", metavar="DIR", help="folder whose bags the page may open")
    parser.add_option(
        "--rewind",
        metavar="SECONDS",
        type="float",
        help="how much of the past the page records (60); 0 for none",
    )
    add_flag(parser, "--no-browser", help="only print the address")
    return parser


def show(tool: str, tab: str, options: Any, usual: str = "", **more: Any) -> int:
    """Open the page at a tab, and serve the page until Ctrl-C.

    `more` contains additional fields of `PageOptions`. `usual` is the view or action in `CHANGING` for which
    the command is intended. On loopback, the page may use it without `--control`, unless `--read-only` is
    set.
    """
    from pipros_page.serve_page import PageOptions, serve_page
    from pipros_page.tabs import CHANGING

    if options.control and options.read_only:
        raise CommandError("--control and --read-only cannot be combined")
    host, port = bind_address(options.bind)
    if options.bags is not None and not Path(options.bags).is_dir():
        raise CommandError(f"--bags must be a folder, got {options.bags}")
    if options.rewind is not None and not 0 <= options.rewind < inf:
        raise CommandError(f"--rewind must be a finite number of seconds >= 0, got {options.rewind}")
    permitted = frozenset({usual} if usual and _is_loopback(host) else ())
    if options.control:
        permitted = frozenset(CHANGING)
    elif options.read_only:
        permitted = frozenset()
    return serve_page(
        PageOptions(
            tool,
            tab,
            host,
            port or 0,
            options.cert,
            options.key,
            options.token_file,
            permitted=permitted,
            saves_layouts=not options.read_only and (_is_loopback(host) or options.control),
            opens_browser=not options.no_browser,
            bags=options.bags,
            rewind_s=options.rewind,
            policy=policy_of(options),
            **more,
        )
    )


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"
