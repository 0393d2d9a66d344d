"""What the parts of a node have in common."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

from pipros.net.loop import BackgroundLoop


@dataclass(frozen=True, slots=True)
class NodeContext:
    """The node that a topic or service belongs to, as far as it has to know.

    Attributes:
        node_name: its full name, the `callerid` of connection headers.
        loop: where its control traffic lives.
        log: where to report.
        next_link_number: numbers its links, for `getBusInfo`.
    """

    node_name: str
    loop: BackgroundLoop
    log: logging.Logger
    next_link_number: Callable[[], int]
