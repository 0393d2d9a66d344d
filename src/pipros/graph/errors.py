"""Errors of `pipros.graph`, and their translation to the exceptions of ROS modules."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from pipros.basics.errors import PiprosError, Unreachable

NO_MASTER = "Unable to communicate with master!"
"""Text printed by Noetic's tools if the master does not answer."""


class GraphError(PiprosError):
    """The requested object does not exist in the running system. The text names it and the place."""


@contextlib.contextmanager
def translated(unreachable: Callable[[str], Exception], failed: Callable[[str], Exception]) -> Iterator[None]:
    """Translate errors of `pipros.graph` to the exceptions that a ROS module documents.

    Args:
        unreachable: function that creates the exception for an unreachable master.
        failed: function that creates the exception for a `GraphError`.
    """
    try:
        yield
    except Unreachable:
        raise unreachable(NO_MASTER) from None
    except GraphError as error:
        raise failed(str(error)) from None
