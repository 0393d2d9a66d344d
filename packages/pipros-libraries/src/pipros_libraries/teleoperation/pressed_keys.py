"""Read the keys pressed in a node's terminal."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Iterator

from pipros.node import Node

POLL_S = 0.1
"""Interval between checks for node shutdown while no key is pressed."""


def pressed_keys(node: Node) -> Iterator[str]:
    """Yield the characters of standard input until it ends or the node is shut down.

    Yield "" every 0.1 s while there is no input.
    """
    descriptor = sys.stdin.fileno()
    while not node.is_ending:
        if not select.select([descriptor], [], [], POLL_S)[0]:
            yield ""
            continue
        read = os.read(descriptor, 1)
        if not read:
            return
        yield read.decode("latin-1")
