"""Shared parts of commands that run network servers: parsing of addresses, policies and remappings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipros.basics.names import is_legal_remapping
from pipros_tools.cli.runner import CommandError

if TYPE_CHECKING:
    from optparse import OptionParser

    from pipros_server.policy.model import Policy


def without_remappings(argv: Sequence[str]) -> list[str]:
    """Return the arguments without remappings such as `__name:=x`, which roslaunch adds for a `<node>`."""
    return [word for word in argv if not is_legal_remapping(word)]


def add_address_options(parser: OptionParser) -> None:
    """Add the options for the address and TLS."""
    parser.add_option(
        "--bind", metavar="HOST[:PORT]", default="127.0.0.1", help="the address to listen on (loopback)"
    )
    parser.add_option("--cert", metavar="FILE", help="the certificate; enables TLS")
    parser.add_option(
        "--key", metavar="FILE", help="the certificate's private key, if it is not in the same file"
    )


def bind_address(text: str) -> tuple[str, int | None]:
    """Parse `HOST`, `HOST:PORT`, `IPV6` or `[IPV6]:PORT`. Return the host and the port, by default None.

    Raises:
        CommandError: the port is not a number from 0 to 65535.
    """
    host, colon, port = text.rpartition(":")
    if not colon or (":" in host and not host.startswith("[")) or text.endswith("]"):
        return text, None
    if not (port.isascii() and port.isdigit()) or int(port) > 65535:
        raise CommandError(f"--bind must be HOST or HOST:PORT with a port from 0 to 65535, got {text}")
    return host, int(port)


def policy_of(options: Any) -> Policy | None:
    """Return the policy from the file given with `--policy`, or None if the option is not given.

    Raises:
        BadSettings: the file cannot be read, or is malformed.
    """
    if options.policy is None:
        return None
    from pipros_server.policy.policy_file import read_policy

    return read_policy(options.policy)
