"""Keys pressed in the terminal of a node."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Iterator

from pipros.node import Node

POLL_S = 0.1
"""How soon the end of the node is noticed while no key is pressed."""


def pressed_keys(node: Node) -> Iterator[str]:
    """Yield the characters of standard input, "" after 0.1 s without one, until it or the node ends."""
    descriptor = sys.stdin.fileno()
    while not node.is_ending:
        if not select.select([descriptor], [], [], POLL_S)[0]:
            yield ""
            continue
        read = os.read(descriptor, 1)
        if not read:
            return
        yield read.decode("latin-1")
