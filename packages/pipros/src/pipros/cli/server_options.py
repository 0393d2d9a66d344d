"""Shared parts of commands that run network servers: parsing of addresses, policies and remappings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipros.basics.names import is_legal_remapping
from pipros.cli.runner import CommandError

if TYPE_CHECKING:
    from pipros.policy.model import Policy


def without_remappings(argv: Sequence[str]) -> list[str]:
    """Return the arguments without remappings such as `__name:=x`, which roslaunch adds for a `<node>`."""
    return [word for word in argv if not is_legal_remapping(word)]


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
    from pipros.policy.policy_file import read_policy

    return read_policy(options.policy)
