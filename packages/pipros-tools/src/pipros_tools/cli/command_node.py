"""The node for a command that publishes, subscribes or calls services."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.signals import ended_by_signals
from pipros.node.start_params import is_on


@contextlib.contextmanager
def command_node(
    name: str, argv: Sequence[str] = (), *, wall_time: bool = False, insist: bool = True
) -> Iterator[Node]:
    """Context manager that runs a node with a unique name, and unregisters it on exit, even after an error.

    Ctrl-C and SIGTERM shut the node down; see `ended_by_signals`.

    Args:
        argv: the command line, including the node's remapping arguments.
        wall_time: whether to use the machine's clock even if `/use_sim_time` is set.
        insist: see `ended_by_signals`.
    """
    node = Node(name, anonymous=True, argv=argv)
    with ended_by_signals(node, insist=insist):
        if not wall_time:
            with contextlib.suppress(PiprosError):  # continue even if there is no master
                if is_on(node, "/use_sim_time"):
                    node.use_simulated_time()
        yield node
