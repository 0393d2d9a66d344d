"""The node behind a command that publishes, listens or calls."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator, Sequence
from types import FrameType

from pipros.errors import PiprosError
from pipros.node import Node
from pipros.node.start_params import is_on


@contextlib.contextmanager
def command_node(name: str, argv: Sequence[str] = (), *, wall_time: bool = False) -> Iterator[Node]:
    """A started node with a unique name, which unregisters itself however the command ends.

    SIGTERM ends the command as Ctrl-C does.

    Args:
        argv: the command line, with the remapping arguments of the node.
        wall_time: use the machine's clock even when `/use_sim_time` is set.
    """
    node = Node(name, anonymous=True, argv=argv)
    with _sigterm_as_ctrl_c(), node:
        if not wall_time:
            with contextlib.suppress(PiprosError):  # a command goes on without a master
                if is_on(node, "/use_sim_time"):
                    node.use_simulated_time()
        yield node


@contextlib.contextmanager
def _sigterm_as_ctrl_c() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt
