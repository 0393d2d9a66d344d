"""`rosnode machine`: on which machines nodes run."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.cli.program import CommandError, Surroundings, option_parser
from pipros.cli.rosnode.listing import api_of, node_names
from pipros.net.master import MasterClient


def show_machines(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "machine [machine-name]")
    _, arguments = parser.parse_args(list(argv))
    if len(arguments) > 1:
        parser.error("please enter only one machine name")
    with Surroundings("rosnode") as here:
        lines = nodes_on(here.master, arguments[0]) if arguments else machines(here.master)
    print("\n".join(lines))
    return 0


def machines(master: MasterClient) -> list[str]:
    """The hosts that nodes run on, as they call themselves, sorted."""
    return sorted(set(_hosts(master).values()))


def nodes_on(master: MasterClient, machine: str) -> list[str]:
    """The nodes on a machine, whatever name or address of it they were registered with.

    Raises:
        CommandError: the machine's name has no address.
    """
    addresses = _addresses(machine)
    if not addresses:
        raise CommandError(f"cannot resolve machine name [{machine}] to address")
    return [node for node, host in _hosts(master).items() if host == machine or addresses & _addresses(host)]


def _hosts(master: MasterClient) -> dict[str, str]:
    """The host of each node whose address is known, by node, sorted."""
    from pipros.net.address import split_uri

    hosts = {}
    for node in node_names(master):
        try:
            hosts[node] = split_uri(api_of(master, node))[0]
        except ValueError:  # left meanwhile, or registered with an address that is none
            continue
    return hosts


def _addresses(host: str) -> set[object]:
    import socket

    try:
        return {info[4][0] for info in socket.getaddrinfo(host, None)}
    except OSError:
        return set()
