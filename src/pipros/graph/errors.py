"""What the functions of this room raise, and how facades turn it into the exceptions of ROS."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from pipros.errors import PiprosError, Unreachable

NO_MASTER = "Unable to communicate with master!"
"""What Noetic's tools say when the master does not answer."""


class GraphError(PiprosError):
    """The running system cannot give what was asked for. The text says what is missing and where."""


@contextlib.contextmanager
def translated(unreachable: Callable[[str], Exception], failed: Callable[[str], Exception]) -> Iterator[None]:
    """Raises the exceptions that a ROS module promises in place of those of this room.

    Args:
        unreachable: makes the one for a master that does not answer.
        failed: makes the one for a question without an answer (`GraphError`).
    """
    try:
        yield
    except Unreachable:
        raise unreachable(NO_MASTER) from None
    except GraphError as error:
        raise failed(str(error)) from None
