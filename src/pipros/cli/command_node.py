"""The node behind a command that publishes, listens or calls."""

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
    """A started node with a unique name, which unregisters itself however the command ends.

    Ctrl-C and SIGTERM shut the node down; see `ended_by_signals`.

    Args:
        argv: the command line, with the remapping arguments of the node.
        wall_time: use the machine's clock even when `/use_sim_time` is set.
        insist: see `ended_by_signals`.
    """
    node = Node(name, anonymous=True, argv=argv)
    with ended_by_signals(node, node, insist=insist):
        if not wall_time:
            with contextlib.suppress(PiprosError):  # a command goes on without a master
                if is_on(node, "/use_sim_time"):
                    node.use_simulated_time()
        yield node


@contextlib.contextmanager
def ended_by_signals(
    node: Node, life: contextlib.AbstractContextManager[object], *, insist: bool = True
) -> Iterator[None]:
    """Runs the block within `life`, which starts the node; SIGINT and SIGTERM shut the node down.

    They raise nothing in the block unless it goes on after the shutdown, which ends all waits for the node.
    An exception of a block that was ended that way counts as KeyboardInterrupt. In a thread other than the
    main one signals are left alone.

    Args:
        insist: interrupt a block that goes on after the shutdown, whoever asked for it. Otherwise only a
            second signal does, so that the block may finish what it is writing.
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
