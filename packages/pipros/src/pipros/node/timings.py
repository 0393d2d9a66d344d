"""Delays and timeouts of a node. Programs use the defaults; tests and special networks change them."""

from __future__ import annotations

from typing import NamedTuple

from pipros.net.timings import LINK_TIMINGS, LinkTimings


class NodeTimings(NamedTuple):
    """Delays and timeouts of a node.

    Attributes:
        retry_longest_s: longest delay between attempts to reach a publisher that the master still lists.
        retry_refused_first_s: first delay after a refusal. A refusal rarely resolves itself, but a publisher
            at its connection limit may have room later.
        slow_attempt_s: an attempt to connect that takes longer no longer counts towards the limit on
            concurrent attempts, because most hosts that take this long never respond.
        early_connect_s: maximum time for connecting to the server of a service's last call before the
            master's response is read.
        close_flush_s: how long closing waits in total for the last messages to be sent, so that a slow
            subscriber does not block the node's shutdown.
        call_grace_s: how long running service calls may continue when the node begins to shut down. Without
            it, a loop that calls a service would often end with an error at Ctrl-C.
        callback_grace_s: how long closing waits in total for running callbacks. Python ends the threads of
            later ones in the middle, and C++ code such as OpenCV's then aborts the process.
        unregister_s: how long a node waits, while shutting down, for a master that does not answer.
        clock_silence_s: how long a thread waits for the first message on `/clock` before a warning is logged.
        links: delays and timeouts of the connections.
    """

    retry_longest_s: float = 5.0
    retry_refused_first_s: float = 5.0
    slow_attempt_s: float = 1.0
    early_connect_s: float = 0.05
    close_flush_s: float = 0.2
    call_grace_s: float = 0.1
    callback_grace_s: float = 0.2
    unregister_s: float = 0.3
    clock_silence_s: float = 5.0
    links: LinkTimings = LINK_TIMINGS


NODE_TIMINGS = NodeTimings()
"""The defaults."""
