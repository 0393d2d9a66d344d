"""Connections to devices: serial ports, TCP and UDP. Calls block for a fraction of a second at most.

Only opening a TCP connection may take `CONNECT_S`, and longer if the name of the host has to be looked up.
"""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import MissingExtra, PiprosError
from pipros.basics.extras import install_command

POLL_S: Final = 0.1
CONNECT_S: Final = 3.0
COLLECT_S: Final = 0.005
"""How long a serial port collects bytes after the first one. Otherwise each would wake the driver."""
CHUNK_BYTES: Final = 1 << 16


class DeviceError(PiprosError):
    """A device does not work. The text names it."""


class StreamLost(DeviceError):
    """A device cannot be reached, or the connection to it has ended."""


class Stream:
    """An open connection to a device, over the file descriptor of a serial port or a socket."""

    def __init__(self, name: str, handle: Any, *, is_serial: bool) -> None:
        """Take over `handle`, an object with `fileno` and `close` that does not block."""
        self._name, self._handle, self._is_serial = name, handle, is_serial

    def read(self) -> bytes:
        """Return the data that has arrived, at most 64 KiB, or b"" after `POLL_S` without data.

        Raises:
            StreamLost: the connection has ended. So do the other methods.
        """
        try:
            if not select.select([self._handle], [], [], POLL_S)[0]:
                return b""
            if self._is_serial:
                time.sleep(COLLECT_S)
            data = os.read(self._handle.fileno(), CHUNK_BYTES)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise StreamLost(f"lost {self._name}: {error.strerror}") from None
        if not data:
            raise StreamLost(f"lost {self._name}: the connection was closed")
        return data

    def write(self, data: bytes) -> None:
        """Send a few bytes, such as a command."""
        try:
            sent = os.write(self._handle.fileno(), data)
        except OSError as error:
            raise StreamLost(f"cannot write to {self._name}: {error.strerror}") from None
        if sent < len(data):
            raise StreamLost(f"cannot write to {self._name}: the device accepts no data")

    def set_dtr(self, is_on: bool) -> None:
        """Switch the DTR line of a serial port, if it has one."""
        if self._is_serial:
            with suppress(OSError):
                self._handle.dtr = is_on

    def close(self) -> None:
        """Close the connection. Data that has not been sent is lost."""
        if self._is_serial:
            with suppress(Exception):  # also termios.error; closing would wait until all is sent
                self._handle.reset_output_buffer()
        with suppress(OSError):
            self._handle.close()


@dataclass(frozen=True, slots=True)
class Port:
    """The name of a device's port, and how to open it, which raises StreamLost."""

    name: str
    open: Callable[[], Stream]


def serial_port(path: str, baud: int) -> Port:
    """Return a serial port.

    Raises:
        MissingExtra: pyserial is not installed.
    """
    try:
        import serial
    except ImportError as error:
        raise MissingExtra(
            f"serial ports need pyserial, which is not installed. Try: {install_command('drivers')}",
            name=error.name,
        ) from error

    def opened() -> Stream:
        try:
            return Stream(path, serial.Serial(path, baud, exclusive=True), is_serial=True)
        except (OSError, ValueError, OverflowError) as error:
            number = getattr(error, "errno", None)
            reason = os.strerror(number) if number else str(error)  # pyserial's text repeats the path
            raise StreamLost(f"cannot open {path}: {reason}") from None

    return Port(path, opened)


def network_port(host: str, number: int, kind: socket.SocketKind = socket.SOCK_STREAM) -> Port:
    """Return a TCP port of a device, or with SOCK_DGRAM a UDP port."""
    name = f"{host}:{number}"

    def opened() -> Stream:
        try:
            if kind is socket.SOCK_STREAM:
                connection = socket.create_connection((host, number), CONNECT_S)
            else:
                family, _, _, _, address = socket.getaddrinfo(host, number, type=kind)[0]
                connection = socket.socket(family, kind)
                connection.connect(address)
            connection.setblocking(False)
        except (OSError, OverflowError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise StreamLost(f"cannot connect to {name}: {reason}") from None
        return Stream(name, connection, is_serial=False)

    return Port(name, opened)
