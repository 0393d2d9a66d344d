"""The node behind a command that publishes, listens or calls."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from types import FrameType

from pipros.errors import PiprosError
from pipros.node import Node

WAIT_SLICE_S = 0.2


def wait(wait_for: Callable[[float], bool], timeout_s: float | None = None) -> bool:
    """Waits with `wait_for`, such as `event.wait`, in the main thread; False when the time is over first.

    In slices: a signal that arrives in the moment in which an endless wait begins is not looked at
    until the wait is over, and Ctrl-C would be lost.
    """
    deadline = None if timeout_s is None else time.monotonic() + timeout_s
    while True:
        left = WAIT_SLICE_S if deadline is None else min(WAIT_SLICE_S, deadline - time.monotonic())
        if wait_for(max(left, 0)):
            return True
        if left <= 0:
            return False


@contextlib.contextmanager
def command_node(name: str, argv: Sequence[str] = (), *, wall_time: bool = False) -> Iterator[Node]:
    """A started node with a unique name, that leaves the graph in good order however the command ends.

    SIGTERM ends the command the way Ctrl-C does.

    Args:
        argv: the command line; its remapping arguments name the node and its topics.
        wall_time: keep to the machine's clock, even when the system's time is simulated.
    """
    node = Node(name, anonymous=True, argv=argv)
    with _sigterm_as_ctrl_c(), node:
        if not wall_time:
            with contextlib.suppress(PiprosError):
                if node.params.get("/use_sim_time") is True:
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
