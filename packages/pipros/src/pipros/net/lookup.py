"""Resolve host names, with interruptible waits.

The system's lookup cannot be interrupted, and blocks for half a minute if a name server is silent. Lookups
therefore run in daemon threads, for which neither Ctrl-C nor interpreter exit waits. The number of threads is
limited. Callers that look up the same name share one lookup, whose result is cached for a few seconds.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import Interrupted

if TYPE_CHECKING:
    from pipros.net.workers import Workers

LOOKUPS = 64
"""Limit: concurrent lookups of host names. Beyond it, further lookups wait; lookups of blocking calls are
counted separately, with the same limit.
"""

FOUND_S: Final = 10.0
FAILED_S: Final = 2.0
"""How long addresses (FOUND_S) and failures (FAILED_S) are cached."""

KNOWN_LIMIT: Final = 1000
"""Maximum number of cached results."""

SLICE_S: Final = 0.1
"""Interval at which a wait for a result checks whether it was interrupted."""

Address = tuple[int, int, int, str, tuple[Any, ...]]
"""Family, kind, protocol, canonical name, and socket address."""
Resolve = Callable[..., list[Any]]


class LookupAnswer:
    """The result of a lookup, available now or later. Thread-safe."""

    def __init__(self) -> None:
        self._addresses: list[Address] = []
        self._error: OSError | None = None
        self._is_done = threading.Event()
        self._listeners: list[Callable[[], object]] = []
        self._lock = threading.Lock()

    def set(self, addresses: list[Address], error: OSError | None = None) -> None:
        with self._lock:
            self._addresses, self._error = addresses, error
            self._is_done.set()
            listeners, self._listeners = self._listeners, []
        for listener in listeners:
            listener()

    def wait(self, timeout_s: float) -> bool:
        """Wait for the result; return False if the timeout expires first."""
        return self._is_done.wait(timeout_s)

    def when_done(self, listener: Callable[[], object]) -> None:
        """Call `listener` once the result is available: immediately, or later in the lookup's thread."""
        with self._lock:
            if not self._is_done.is_set():
                self._listeners.append(listener)
                return
        listener()

    def addresses(self, port: int | None) -> list[Address]:
        """Return the addresses, combined with the port. Only valid once the result is available.

        Raises:
            OSError: the name cannot be resolved. This is the error raised by `socket.getaddrinfo`.
        """
        if self._error is not None:
            # raising the same object repeatedly would accumulate tracebacks
            raise type(self._error)(*self._error.args)
        return [(*kind, (where[0], port or 0, *where[2:])) for *kind, where in self._addresses]  # type: ignore[misc]


class Lookups:
    """Looks up host names and caches the results for a few seconds. Thread-safe."""

    def __init__(
        self,
        limit: int,
        *,
        resolve: Resolve | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """Store the settings; lookups start threads when needed.

        Args:
            limit: maximum number of simultaneous lookups, applied separately to urgent lookups (such as those
                of `find`) and to others; further lookups are queued.
            resolve: function that resolves a name; defaults to `socket.getaddrinfo`.
            now: the clock that the cache uses.
        """
        self._limit = limit
        self._resolve: Resolve = resolve or _get_addresses
        self._now = now
        self._begin()

    def ask(self, host: str, *, urgent: bool = False, **wanted: int) -> LookupAnswer:
        """Start the lookup of a name and return at once.

        `wanted` takes the keyword arguments of `socket.getaddrinfo`.
        """
        if self._process != os.getpid():  # a forked child does not inherit the threads
            self._begin()
        answer = LookupAnswer()
        try:
            answer.set(_literal(host, wanted))
            return answer
        except OSError:
            pass  # the host is a name, not an address
        key = (host, *sorted(wanted.items()))
        with self._lock:
            known, until = self._known.get(key, (None, 0.0))
            if known is not None and self._now() < until:
                return known
            self._known.pop(key, None)
            if key in self._under_way:
                return self._under_way[key]
            self._under_way[key] = answer
            workers = self._workers_for(urgent)
        workers.run(self._look_up, key, host, wanted, answer)
        return answer

    def find(
        self,
        host: str,
        port: int | None,
        *,
        deadline: float | None = None,
        is_cancelled: Callable[[], bool] = bool,
        **wanted: int,
    ) -> list[Address]:
        """Resolve a name like `socket.getaddrinfo`, but with a deadline and an interruptible wait.

        Raises:
            OSError: the name cannot be resolved.
            TimeoutError: the deadline (a `time.monotonic()` time) passed.
            Interrupted: `is_cancelled` returned True. It is called every tenth of a second.
        """
        try:
            return _literal(host, wanted, port)  # a fast path, because every service call resolves an address
        except OSError:
            pass  # the host is a name, not an address
        answer = self.ask(host, urgent=True, **wanted)
        while not answer.wait(SLICE_S if deadline is None else min(SLICE_S, deadline - time.monotonic())):
            if is_cancelled():
                raise Interrupted(f"the lookup of {host} was interrupted")
            if deadline is not None and time.monotonic() >= deadline:
                raise TimeoutError(f"the lookup of {host} took too long")
        return answer.addresses(port)

    def _begin(self) -> None:
        self._process = os.getpid()
        self._lock = threading.Lock()
        self._known: OrderedDict[Any, tuple[LookupAnswer, float]] = OrderedDict()
        self._under_way: dict[Any, LookupAnswer] = {}
        self._workers: dict[bool, Workers] = {}

    def _workers_for(self, urgent: bool) -> Workers:
        if urgent not in self._workers:
            from pipros.net.workers import Workers  # imported here because most commands only use addresses

            self._workers[urgent] = Workers("lookup", self._limit, kept_idle=0)
        return self._workers[urgent]

    def _look_up(self, key: Any, host: str, wanted: dict[str, int], answer: LookupAnswer) -> None:
        addresses: list[Address] = []
        error: OSError | None = None
        try:
            addresses = self._resolve(host, None, **wanted)
        except OSError as failure:
            error = failure
        except Exception as failure:  # for example, a UnicodeError for a label of more than 63 characters
            error = socket.gaierror(socket.EAI_NONAME, str(failure))
        with self._lock:
            del self._under_way[key]
            self._known[key] = answer, self._now() + (FAILED_S if error else FOUND_S)
            if len(self._known) > KNOWN_LIMIT:
                self._known.popitem(last=False)
        answer.set(addresses, error)


def _get_addresses(host: str, port: int | None, **wanted: int) -> list[Any]:
    """Call `socket.getaddrinfo` with an ASCII name as bytes, because a str loads Python's IDNA codec."""
    return socket.getaddrinfo(host.encode("ascii") if host.isascii() else host, port, **wanted)


def _literal(host: str, wanted: dict[str, int], port: int | None = None) -> list[Address]:
    """Return the address entries for an IP address, without a lookup.

    Raises:
        OSError: `host` is a name.
    """
    wanted = {**wanted, "flags": wanted.get("flags", 0) | socket.AI_NUMERICHOST}
    try:
        return _get_addresses(host, port, **wanted)
    except UnicodeError as error:
        raise OSError(str(error)) from None


@cache
def process_lookups() -> Lookups:
    """Return the process-wide lookups. A node's event loop uses its own."""

    return Lookups(LOOKUPS)
