"""The errors of `pipros.graph`, and their translation to the exceptions of ROS modules."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from pipros.basics.errors import PiprosError, Unreachable

NO_MASTER = "Unable to communicate with master!"
"""The text of Noetic's tools when the master does not answer."""


class GraphError(PiprosError):
    """The running system does not have what was requested. The text says what is missing and where."""


@contextlib.contextmanager
def translated(unreachable: Callable[[str], Exception], failed: Callable[[str], Exception]) -> Iterator[None]:
    """Replaces the errors of `pipros.graph` by the exceptions that a ROS module promises.

    Args:
        unreachable: makes the exception for a master that does not answer.
        failed: makes the exception for a `GraphError`.
    """
    try:
        yield
    except Unreachable:
        raise unreachable(NO_MASTER) from None
    except GraphError as error:
        raise failed(str(error)) from None
