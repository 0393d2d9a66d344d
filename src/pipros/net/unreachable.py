"""Explains why a peer may be out of reach, and what to do about it."""

from __future__ import annotations

import asyncio
import socket

from pipros.net.address import is_loopback
from pipros.wire.uri import split_uri


async def explain(peer: str) -> str:
    """A sentence of advice about a peer, `http://host:port/` or `host:port`, that did not answer.

    Most "listed but no data" problems of ROS 1 are names and addresses that mean nothing, or
    something else, on another machine (ros_comm#222).
    """
    host = host_of(peer)
    if not await _is_known(host):
        return (
            f". This machine does not know the name [{host}]: set ROS_IP on that machine to an address"
            " that can be reached from here, or make the name known here"
        )
    if is_loopback(host):
        return (
            ". That address means this machine only: the node has ended, or it runs on another machine,"
            " where ROS_IP or ROS_HOSTNAME must be set to what others reach it by"
        )
    return (
        f". The node has ended, a firewall is in between, or [{host}] is not what this machine reaches it"
        " by: set ROS_IP where it runs"
    )


def host_of(peer: str) -> str:
    """The host in a URI or an address; the whole text if it is neither.

    >>> host_of("http://robot:123/"), host_of("10.0.0.1:5"), host_of("rosrpc://[::1]:80"), host_of("robot")
    ('robot', '10.0.0.1', '::1', 'robot')
    """
    try:
        return split_uri(peer if "://" in peer else f"http://{peer}", ["http", "rosrpc"])[0]
    except ValueError:
        return peer


async def _is_known(host: str) -> bool:
    try:
        await asyncio.get_running_loop().getaddrinfo(host, None)
    except socket.gaierror:
        return False
    except OSError:
        return True
    return True
