"""Explain why a peer may be unreachable, and what to try."""

from __future__ import annotations

import asyncio
import socket

from pipros.basics.uri import host_of
from pipros.net.address import is_loopback


async def explain(peer: str) -> str:
    """Return advice about a peer (`http://host:port/` or `host:port`) that did not respond.

    The text begins with a period, because it is appended to an error text.

    If a ROS 1 topic is listed but silent, the usual cause is an advertised host name that other machines
    cannot resolve, or an address that they cannot reach (ros_comm#222).
    """
    host = host_of(peer)
    return advice_on(host, await _why_unknown(host))


def advice_on(host: str, error: Exception | None) -> str:
    """Return the text of `explain` for a host that could not be reached because of an error."""
    if isinstance(error, socket.gaierror):
        return (
            f". This machine cannot resolve the name [{host}]: set ROS_IP on the node's machine to an address"
            " that this machine can reach, or add the name to /etc/hosts"
        )
    if is_loopback(host):
        return (
            ". That address is local: the node has ended, or it runs on another machine,"
            " on which ROS_IP or ROS_HOSTNAME must be set to an address that others can reach"
        )
    return (
        f". The node has ended, a firewall blocks it, or this machine cannot reach it as [{host}]:"
        " set ROS_IP on its machine"
    )


async def _why_unknown(host: str) -> OSError | None:
    try:
        await asyncio.get_running_loop().getaddrinfo(host, None)
    except OSError as error:
        return error
    return None
