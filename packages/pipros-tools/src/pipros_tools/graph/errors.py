"""Errors raised by `pipros_tools.graph`, and their translation into the exceptions that ROS modules raise."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from pipros.basics.errors import PiprosError, Unreachable

NO_MASTER = "Unable to communicate with master!"
"""Text that Noetic's tools print if the master does not answer."""


class GraphError(PiprosError):
    """A request to the running system failed. The error text names the object and the reason."""


@contextlib.contextmanager
def translated(unreachable: Callable[[str], Exception], failed: Callable[[str], Exception]) -> Iterator[None]:
    """Translate errors from `pipros_tools.graph` into the exceptions that a ROS module documents.

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
