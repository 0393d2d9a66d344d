"""`Prompt`, which reads commands and messages from a terminal while a node runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import rospy
from actionlib_tools.library import to_yaml, yaml_msg_str
from pipros.basics.interrupts import interrupt_main_thread
from rospy.core import is_shutdown_requested


class Prompt:
    """Reads lines from the terminal. Use it in the main thread, after `init_node(..., disable_signals=True)`.

    With rospy's signal handlers, Ctrl-C would shut down the node but not interrupt reading.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._is_reading = False
        rospy.on_shutdown(self._wake)

    def read(self) -> str | None:
        """Wait for the next line and return it.

        Return None at the end of the input, or once the node is shut down.

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

    def run(self, do: Callable[[str, str], object]) -> None:
        """Call `do(word, rest)` for each line, until `quit`, the end of the input or shutdown.

        If `do` raises a ValueError, print the error and continue.
        """
        while (line := self.read()) is not None:
            word, _, rest = line.partition(" ")
            if word == "quit":
                return
            try:
                do(word, rest)
            except ValueError as error:
                print(error)


def indented(message: Any) -> str:
    """Return a message as indented YAML."""
    return "\n".join(f"  {line}" for line in to_yaml(message).split("\n"))


def read_message(wanted: Any, text: str) -> Any:
    """Parse a message of the class `wanted` from YAML.

    Raises:
        ValueError: the text is not a valid message of this class.
    """
    try:
        message = yaml_msg_str(wanted, text)
        message._check_types()
    except Exception as error:  # parsing YAML and filling messages can raise various exceptions
        raise ValueError(f"the text is not a valid {wanted._type}: {error}") from None
    return message
