"""`Prompt`, which reads commands from a terminal while a node runs."""

from __future__ import annotations

import rospy
from pipros.basics.interrupts import interrupt_main_thread
from rospy.core import is_shutdown_requested


class Prompt:
    """Reader of lines from the terminal. Use it in the main thread, with a node that has `disable_signals`.

    If rospy's signal handlers were installed, Ctrl-C would shut down the node but not interrupt the read.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._is_reading = False
        rospy.on_shutdown(self._wake)

    def read(self) -> str | None:
        """Block for the next line. Return None at the end of the input, or once the node is shut down.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed and the node is not shut down.
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
