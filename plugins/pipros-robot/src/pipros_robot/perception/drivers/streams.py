"""Connections to devices: serial ports, TCP and UDP. Calls block for a fraction of a second at most.

Only opening a network port can take longer: a TCP connection takes up to `CONNECT_S` for each address of the
host, and there is no limit for the resolution of host names.
"""

from __future__ import annotations

import os
import select
import socket
import time
from contextlib import suppress
from typing import Any, Final

from pipros.basics.extras import missing
from pipros_libraries.nodes.retrying import DeviceError, DevicePort

POLL_S: Final = 0.1
CONNECT_S: Final = 3.0
COLLECT_S: Final = 0.005
"""How long to collect bytes from a serial port after the first, so that not every byte wakes the driver."""
CHUNK_BYTES: Final = 1 << 16


class StreamLost(DeviceError):
    """A device cannot be reached, or its connection was lost."""


class Stream:
    """An open connection to a device over the file descriptor of a serial port or a socket."""

    def __init__(self, name: str, handle: Any, *, is_serial: bool) -> None:
        """Take ownership of `handle`, a non-blocking object with the methods `fileno` and `close`."""
        self._name, self._handle, self._is_serial = name, handle, is_serial

    def read(self) -> bytes:
        """Return up to 64 KiB of received data, or b"" after `POLL_S` without data.

        Raises:
            StreamLost: the connection was lost.
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
        """Send a few bytes, such as a command. Raises `StreamLost` if they cannot be sent."""
        try:
            sent = os.write(self._handle.fileno(), data)
        except OSError as error:
            raise StreamLost(f"cannot write to {self._name}: {error.strerror}") from None
        if sent < len(data):
            raise StreamLost(f"cannot write to {self._name}: the device accepts no data")

    def set_dtr(self, is_on: bool) -> None:
        """Set the DTR line of a serial port. Do nothing for sockets and ports without this line."""
        if self._is_serial:
            with suppress(OSError):
                self._handle.dtr = is_on

    def close(self) -> None:
        """Close the connection. On a serial port, data that has not been sent is lost."""
        if self._is_serial:
            with suppress(Exception):  # including termios.error; without the reset, close waits for output
                self._handle.reset_output_buffer()
        with suppress(OSError):
            self._handle.close()


def serial_port(path: str, baud: int) -> DevicePort[Stream]:
    """Return a serial port.

    Raises:
        MissingExtra: pyserial is not installed.
    """
    try:
        import serial
    except ImportError as error:
        raise missing("serial ports need pyserial", "pipros-robot[drivers]", error) from error

    def opened() -> Stream:
        try:
            return Stream(path, serial.Serial(path, baud, exclusive=True), is_serial=True)
        except (OSError, ValueError, OverflowError) as error:
            number = getattr(error, "errno", None)
            reason = os.strerror(number) if number else str(error)  # pyserial's text repeats the path
            raise StreamLost(f"cannot open {path}: {reason}") from None

    return DevicePort(path, opened)


def network_port(host: str, number: int, kind: socket.SocketKind = socket.SOCK_STREAM) -> DevicePort[Stream]:
    """Return a TCP port or, if `kind` is SOCK_DGRAM, a UDP port."""
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

    return DevicePort(name, opened)
