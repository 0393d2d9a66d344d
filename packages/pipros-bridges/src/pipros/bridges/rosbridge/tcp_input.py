"""Data from a rosbridge client over TCP, with deadlines and limits."""

from __future__ import annotations

import asyncio
from typing import Final

from pipros.basics.limits import Limits
from pipros.bridges.rosbridge.session import RosbridgeSession
from pipros.bridges.shares import ClientShares

CHUNK_BYTES: Final = 64 * 1024
GROWTH_BYTES: Final = 1024 * 1024
"""An incomplete message must grow by this much, or end, within `request_s`."""
PART_BYTES: Final = 100
"""Memory of a part of a message besides its data. It is counted, because tiny parts could fill the memory."""


class TcpInput:
    """Reads from one client.

    Until the client has logged in, all its data must arrive within `login_s` and fit in `login_bytes`.
    Afterwards, each incomplete message must keep growing.
    """

    def __init__(
        self, session: RosbridgeSession, reader: asyncio.StreamReader, limits: Limits, shares: ClientShares
    ) -> None:
        self._session = session
        self._reader = reader
        self._limits = limits
        self._shares = shares
        self._loop = asyncio.get_running_loop()
        self._login_end_s = self._loop.time() + limits.login_s
        self._login_bytes = limits.login_bytes
        self._end_s: float | None = None  # deadline for the next MiB of an incomplete message
        self._grown_bytes = 0
        self._held_bytes = 0

    async def read(self, incomplete_bytes: int) -> bytes:
        """Return the next data; empty at the end of the stream.

        Args:
            incomplete_bytes: size of the incomplete message so far; 0 between messages.

        Raises:
            asyncio.TimeoutError: the client is too slow.
            EOFError: the client has sent too much before logging in.
        """
        return await self._read(CHUNK_BYTES, incomplete_bytes)

    async def read_all(self, count: int) -> bytes:
        """Return exactly `count` bytes, or no bytes if the stream ends earlier.

        The bytes count against the client's share of memory until `end_message`.

        Raises:
            asyncio.TimeoutError: the client is too slow.
            EOFError: the client has sent too much before logging in, or exceeds its share of memory.
        """
        parts: list[bytes] = []
        left = count
        while left:
            data = await self._read(min(left, CHUNK_BYTES), self._held_bytes)
            if not data:
                return b""
            cost = len(data) + PART_BYTES
            if not self._shares.input.take(cost):
                raise EOFError
            self._held_bytes += cost
            left -= len(data)
            parts.append(data)
        return b"".join(parts)

    def end_message(self) -> None:
        """Stop counting the data of a message that has been handled."""
        self._shares.input.give_back(self._held_bytes)
        self._held_bytes = 0

    async def _read(self, max_bytes: int, incomplete_bytes: int) -> bytes:
        is_known = self._session.is_logged_in
        if not is_known:
            max_bytes = min(max_bytes, self._login_bytes)
            if not max_bytes:
                raise EOFError
        end_s = self._deadline(incomplete_bytes) if is_known else self._login_end_s
        left_s = None if end_s is None else end_s - self._loop.time()
        data = await asyncio.wait_for(self._reader.read(max_bytes), left_s)
        if not is_known:
            self._login_bytes -= len(data)
        return data

    def _deadline(self, incomplete_bytes: int) -> float | None:
        """Return when an incomplete message must have grown; None between messages."""
        if not incomplete_bytes:
            self._end_s = None
        elif self._end_s is None or incomplete_bytes >= self._grown_bytes + GROWTH_BYTES:
            self._end_s = self._loop.time() + self._limits.request_s
            self._grown_bytes = incomplete_bytes
        return self._end_s
