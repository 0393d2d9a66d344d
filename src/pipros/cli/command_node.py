"""The node of a command that publishes, subscribes or calls services."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator, Sequence

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.signals import Signals
from pipros.node.start_params import is_on


@contextlib.contextmanager
def command_node(
    name: str, argv: Sequence[str] = (), *, wall_time: bool = False, insist: bool = True
) -> Iterator[Node]:
    """Start a node with a unique name; it is unregistered however the command ends.

    Ctrl-C and SIGTERM shut the node down; see `ended_by_signals`.

    Args:
        argv: the command line, including the node's remapping arguments.
        wall_time: whether to use the machine's clock even if `/use_sim_time` is set.
        insist: see `ended_by_signals`.
    """
    node = Node(name, anonymous=True, argv=argv)
    with ended_by_signals(node, node, insist=insist):
        if not wall_time:
            with contextlib.suppress(PiprosError):  # a command continues without a master
                if is_on(node, "/use_sim_time"):
                    node.use_simulated_time()
        yield node


@contextlib.contextmanager
def ended_by_signals(
    node: Node, life: contextlib.AbstractContextManager[object], *, insist: bool = True
) -> Iterator[None]:
    """Run the block within `life`, which starts the node; SIGINT and SIGTERM shut the node down.

    A signal raises nothing in the block unless the block continues after the shutdown, which ends all waits
    for the node. An exception of a block ended by a signal counts as KeyboardInterrupt. Outside the main
    thread, signal handlers are left unchanged.

    Args:
        insist: interrupt a block that continues after any shutdown. Otherwise only a second signal does, so
            that the block can finish writing.
    """
    if threading.current_thread() is not threading.main_thread():
        with life:
            yield
        return
    signals = Signals(node.shutdown, insist=insist)
    signals.install()
    try:
        with life:
            signals.listen(node)
            yield
    except Exception:
        if signals.have_come:
            raise KeyboardInterrupt from None
        raise
    finally:
        signals.uninstall()
