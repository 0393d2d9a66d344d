"""Replacements for the functions of Python that create sockets or wait for them."""

from __future__ import annotations

import os
import select
import selectors
import socket
from collections.abc import Callable, Sequence
from typing import Any, Final

from pipros_tab.network import Network
from pipros_tab.tab_socket import FIRST_DESCRIPTOR, HERE, OPTIONS, TabSocket

KEYBOARD: Final = 0
"""The descriptor of the keys that are pressed in the terminal."""
_read = os.read
_IN, _OUT, _INVALID = 1, 4, 32  # POLLIN, POLLOUT and POLLNVAL, which select lacks on Windows


def socketpair(*_: object) -> tuple[TabSocket, TabSocket]:
    """Return two connected sockets. asyncio uses them to wake its loop."""
    server = TabSocket()
    server.bind((HERE, 0))
    with server:
        first = TabSocket()
        first.connect(server.getsockname())
        return first, server.accept()[0]


def getaddrinfo(
    host: str | bytes | None, port: int | str | None, family: int = 0, *_: object, **__: object
) -> list[tuple[Any, ...]]:
    """Return the address of the tab for the names and addresses of this machine.

    Raises:
        socket.gaierror: the host is another one, or another family was requested.
    """
    name = host.decode() if isinstance(host, bytes) else host
    own = (None, "", "localhost", "0.0.0.0", socket.gethostname())  # noqa: S104 # it is only compared
    if name not in own and not str(name).startswith("127."):
        raise socket.gaierror(socket.EAI_NONAME, f"a browser tab reaches only its own nodes, not [{name}]")
    if family not in (0, socket.AF_INET):
        raise socket.gaierror(socket.EAI_NONAME, "a browser tab has only IPv4 addresses")
    return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (HERE, int(port or 0)))]


def _events(number: int) -> int:
    """Return what a descriptor is ready for. Files and closed sockets, which are invalid, always are."""
    sock = TabSocket.by_descriptor.get(number)
    if sock is not None:
        return (_IN if sock.is_readable else 0) | (_OUT if sock.is_writable else 0)
    if number == KEYBOARD:
        TabSocket.network.ask_for_keys()
        return _IN if TabSocket.network.keys else 0
    return _IN | _OUT | (_INVALID if number >= FIRST_DESCRIPTOR else 0)


class TabSelector(selectors.SelectSelector):
    """Watches sockets of the tab."""

    def ready(self) -> list[tuple[selectors.SelectorKey, int]]:
        """Return the sockets that are ready now, with their events."""
        found = []
        for key in list(self.get_map().values()):
            now = _events(key.fd)
            events = (now & _IN) | (selectors.EVENT_WRITE if now & _OUT else 0)  # EVENT_READ is _IN
            if events & key.events:
                found.append((key, events & key.events))
        return found

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait until a socket is ready; return the sockets that are ready, with their events."""
        if timeout is None or timeout > 0:
            TabSocket.network.wait(lambda: bool(self.ready()), timeout)
        return self.ready()


class TabPoll:
    """A replacement for `select.poll`."""

    def __init__(self) -> None:
        self._watched: dict[int, int] = {}

    def register(self, file: Any, events: int = _IN | _OUT) -> None:
        self._watched[_number(file)] = events

    def poll(self, timeout_ms: float | None = None) -> list[tuple[int, int]]:
        """Wait until a socket is ready; return the descriptors that are ready, with their events."""
        if timeout_ms is None or timeout_ms > 0:
            TabSocket.wait(lambda: bool(self._ready()), None if timeout_ms is None else timeout_ms / 1000)
        return self._ready()

    def _ready(self) -> list[tuple[int, int]]:
        found = ((number, _events(number) & (wanted | _INVALID)) for number, wanted in self._watched.items())
        return [(number, events & _INVALID or events) for number, events in found if events]


def _number(file: Any) -> int:
    number: int = file if isinstance(file, int) else file.fileno()
    if number < 0:
        raise ValueError(f"file descriptor cannot be a negative integer ({number})")
    return number


def wait_for_any(
    reading: Sequence[Any], writing: Sequence[Any], _failing: object, timeout: float | None = None
) -> tuple[list[Any], list[Any], list[Any]]:
    """Do the same as `select.select`, for sockets, the keyboard and files, or their descriptors."""
    readers, writers = ([(_number(each), each) for each in files] for files in (reading, writing))

    def ready() -> tuple[list[Any], list[Any], list[Any]]:
        return (
            [each for number, each in readers if _events(number) & _IN],
            [each for number, each in writers if _events(number) & _OUT],
            [],
        )

    if timeout is None or timeout > 0:
        TabSocket.wait(lambda: any(ready()), timeout)
    return ready()


def read(descriptor: int, count: int) -> bytes:
    """Do the same as `os.read`, also for the keyboard."""
    if descriptor != KEYBOARD:
        return _read(descriptor, count)
    wait_for_any([KEYBOARD], [], [])
    keys = TabSocket.network.keys
    taken = bytes(keys[:count])
    del keys[:count]
    return taken


def install(network: Network, wait: Callable[[Callable[[], bool], float | None], bool]) -> None:
    """Replace Python's sockets. Call it before other modules import them.

    Args:
        network: the network of the worker.
        wait: waits until a function returns True, or a timeout expires, and runs event loops meanwhile.
    """
    TabSocket.network, TabSocket.wait = network, staticmethod(wait)
    for name, value in OPTIONS.items():
        if not hasattr(socket, name):
            setattr(socket, name, value)
    for module, name, new in (
        (socket, "socket", TabSocket),
        (socket, "SocketType", TabSocket),
        (socket, "socketpair", socketpair),
        (socket, "getaddrinfo", getaddrinfo),
        (os, "read", read),
        (select, "select", wait_for_any),
        (select, "poll", TabPoll),
        (selectors, "DefaultSelector", TabSelector),
    ):
        setattr(module, name, new)
