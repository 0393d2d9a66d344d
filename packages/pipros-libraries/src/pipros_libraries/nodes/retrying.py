"""Keep a node connected to its device: reconnect at increasing intervals, and report failures once."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, Protocol, TypeVar

from pipros.basics.errors import PiprosError
from pipros.node import Node

PAUSES_S: Final = (0.5, 4.0)
"""The first and the longest pause between attempts."""
END_S: Final = 0.3
"""Maximum time for which node shutdown waits for the driver, which may have to stop a motor."""


class DeviceError(PiprosError):
    """A device does not work. The text names the device."""


class DeviceConnection(Protocol):
    """An open connection to a device."""

    def close(self) -> None: ...


Stream = TypeVar("Stream", bound=DeviceConnection)


@dataclass(frozen=True, slots=True)
class DevicePort(Generic[Stream]):
    """A device's port: its name, and a function that opens a connection or raises DeviceError."""

    name: str
    open: Callable[[], Stream]


class Driver(Generic[Stream]):
    """Runs sessions with a device in a thread, until the node is shut down.

    If the device fails, the session is restarted after a pause. In each outage, an error is logged once per
    exception type. The thread delays node shutdown by at most `END_S`.
    """

    def __init__(
        self,
        node: Node,
        log: logging.Logger,
        port: DevicePort[Stream],
        session: Callable[[Stream], None],
        pauses_s: tuple[float, float] = PAUSES_S,
    ) -> None:
        """Store the arguments; `run` starts the thread.

        Args:
            session: function that communicates with the device over the open stream. It must return when
                `is_ending` is true, raise DeviceError if the device fails, and call `report_data` whenever
                data arrives.
            pauses_s: the first and the longest pause between attempts.
        """
        self._node, self._log, self._port, self._session = node, log, port, session
        self._pauses_s = pauses_s
        self._reported: set[type[DeviceError]] = set()
        self._has_failed = False
        self._has_ended = threading.Event()
        self._description = ""

    @property
    def is_ending(self) -> bool:
        """Whether the node is shutting down."""
        return self._node.is_ending

    def report_data(self) -> None:
        """Record that the device works, which ends an outage."""
        if self._reported:
            self._reported.clear()
            self._log.info("%s works again", self._port.name)

    def describe(self, text: str) -> None:
        """Log the device's information if it has changed."""
        if text != self._description:
            self._description = text
            self._log.info("%s: %s", self._port.name, text)

    def run(self) -> int:
        """Run until the node is shut down, and return the exit code: 1 after an internal error."""
        self._node.on_shutdown(lambda: self._has_ended.wait(END_S))
        threading.Thread(target=self._run, name=f"device {self._port.name}", daemon=True).start()
        self._node.wait_for_shutdown()
        return int(self._has_failed)

    def _run(self) -> None:
        try:
            self._keep_connected()
        except Exception:
            if not self.is_ending:
                self._has_failed = True
                self._log.critical("the driver of %s failed", self._port.name, exc_info=True)
                self._node.shutdown_async("the driver failed")
        finally:
            self._has_ended.set()

    def _keep_connected(self) -> None:
        pause_s, longest_s = self._pauses_s
        while not self.is_ending:
            began_s = time.monotonic()
            try:
                stream = self._port.open()
                try:
                    self._session(stream)
                finally:
                    stream.close()
            except DeviceError as error:
                if not self.is_ending and type(error) not in self._reported:
                    self._reported.add(type(error))
                    self._log.error("%s. Trying again until it works.", error)
            if time.monotonic() - began_s > longest_s:
                pause_s = self._pauses_s[0]
            self._node.wait_for_shutdown(pause_s)
            pause_s = min(2 * pause_s, longest_s)
