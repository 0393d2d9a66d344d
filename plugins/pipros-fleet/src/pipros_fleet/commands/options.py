"""Options of commands that connect to a router."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from optparse import OptionParser
from typing import TYPE_CHECKING, Any

from pipros_tools.cli.runner import CommandError

if TYPE_CHECKING:
    from pipros_fleet.zenoh_session import SessionLink, Tls

ROUTER = "tcp/127.0.0.1:7447"


def add_link_options(parser: OptionParser) -> None:
    """Add the options for the router's address and for this member's certificates."""
    parser.add_option("--router", metavar="ADDRESS", help=f"tcp/HOST:PORT or tls/HOST:PORT ({ROUTER})")
    parser.add_option(
        "--keys", metavar="FOLDER", help="folder made by `pipros fleet keys add`, for a router with TLS"
    )


def tls_of(options: Any, router: str) -> Tls | None:
    """Return the certificates in the folder given with `--keys`, or None without TLS.

    Raises:
        CommandError: the router uses TLS but `--keys` is missing, or vice versa.
    """
    if options.keys is None:
        if router.startswith("tls/"):
            raise CommandError(f"{router} needs --keys FOLDER, a folder made by `pipros fleet keys add`")
        return None
    if not router.startswith("tls/"):
        raise CommandError(f"--keys requires a router with TLS (tls/HOST:PORT), got {router}")
    from pipros_fleet.key_files import read_keys

    return read_keys(options.keys).tls


@contextmanager
def link_of(options: Any) -> Iterator[SessionLink]:
    """Connect to the router given by the options, and disconnect when the context ends."""
    from pipros_fleet.zenoh_connecting import connect

    router = options.router or ROUTER
    link = connect(router, tls_of(options, router), asker=caller_of(options))
    try:
        yield link
    finally:
        link.close()


def caller_of(options: Any) -> str:
    """Return the name to use in requests: that of the `--keys` folder, or `observer` without `--keys`."""
    if options.keys is None:
        from pipros_fleet.zenoh_connecting import OBSERVER

        return OBSERVER
    from pipros_fleet.key_files import read_keys

    return read_keys(options.keys).member
