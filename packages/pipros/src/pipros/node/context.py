"""Objects that are shared by the parts of a node."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import NamedTuple

from pipros.basics.budget import Budget
from pipros.basics.limits import Limits
from pipros.net.busy_poll import PublishCount
from pipros.net.connection_table import ConnectionTable
from pipros.net.held_bytes import HeldBytes
from pipros.net.loop import BackgroundLoop
from pipros.node.attempts import Attempts
from pipros.node.timings import NODE_TIMINGS, NodeTimings

NO_ARGS = object()
"""Sentinel for "no callback_args", because None is a valid value."""


class NodeContext(NamedTuple):
    """The parts of a node that its topics and services use.

    Attributes:
        node_name: the node's full name, which is the `callerid` in connection headers.
        loop: event loop that runs the node's control traffic.
        log: the node's logger.
        next_link_number: counter that numbers the node's links for `getBusInfo`.
        limits: the limits on the resources that peers can use.
        connections: the node's TCPROS connections.
        attempts: limits the node's concurrent attempts to connect to publishers.
        published: counter that changes with each message that the node publishes.
        received: counter that changes whenever the node has received messages on a topic.
        memory: budget for the memory that the node shares with subscribers on this machine.
        incomplete: the bytes of requests and messages whose rest has not arrived; for use in the event loop.
        reported: the URIs of nodes that are reported as unreachable: each is reported once, not per topic;
            for use in the event loop.
        timings: the node's delays and timeouts.
    """

    node_name: str
    loop: BackgroundLoop
    log: logging.Logger
    next_link_number: Callable[[], int]
    limits: Limits
    connections: ConnectionTable
    attempts: Attempts
    published: PublishCount
    received: PublishCount
    memory: Budget
    incomplete: HeldBytes
    reported: set[str]
    timings: NodeTimings = NODE_TIMINGS
