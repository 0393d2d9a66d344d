"""Reads commands of a terminal's user, as long as the node runs."""

from __future__ import annotations

import rospy
from pipros.interrupts import interrupt_main_thread
from rospy.core import is_shutdown_requested


class Prompt:
    """Lines from the terminal. Use it in the main thread, with a node made with `disable_signals`.

    With the handlers of rospy, Ctrl-C would end the node but not the wait for a line.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._is_reading = False
        rospy.on_shutdown(self._wake)

    def read(self) -> str | None:
        """The next line; None at the end of the input, and when the node has been shut down.

        Raises:
            KeyboardInterrupt: Ctrl-C.
        """
        self._is_reading = True
        try:
            return None if is_shutdown_requested() else input(self._text).strip()
        except EOFError:
            print()
            return None
        except KeyboardInterrupt:
            print()
            if is_shutdown_requested():
                return None
            raise
        finally:
            self._is_reading = False

    def _wake(self) -> None:
        if self._is_reading:
            interrupt_main_thread()
