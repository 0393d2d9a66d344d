"""A connection whose data takes long to parse rests, and receives its message whole."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

from websockets.asyncio.client import connect

from pipros.basics.budget import Budget
from pipros.basics.limits import Limits
from pipros.server.listener import Entrance
from pipros.server.port import LONG_S, PART_BYTES, PortConnection, ServerPort

MESSAGE = "".join(chr(97 + number % 26) for number in range(300_000))


class Work:
    """A clock of processor time, in which some parts of the data take long."""

    def __init__(self) -> None:
        self.long_parts = 0
        self._now_s = 0.0
        self._is_end = False

    def __call__(self) -> float:
        if self._is_end and self.long_parts:
            self.long_parts -= 1
            self._now_s += 2 * LONG_S
        self._is_end = not self._is_end
        return self._now_s


class Recorded(PortConnection):
    """Records the sizes of the parts that it parses, and whether it read meanwhile."""

    def __init__(self, work: Work, *args: Any, **options: Any) -> None:
        super().__init__(*args, work_clock=work, **options)
        self.sizes: list[int] = []

    def _rest_for(self, seconds: float) -> None:
        self.sizes.append(self._part_bytes)
        super()._rest_for(seconds / 100)


def test_parts_become_smaller_and_the_message_arrives_whole() -> None:
    async def run() -> None:
        work, connections, received = Work(), [], asyncio.Queue[Any]()

        def make(*args: Any, **options: Any) -> Recorded:
            connections.append(Recorded(work, *args, **options))
            return connections[-1]

        async def attend(connection: Recorded) -> None:
            connection.admit(Budget(1_000_000), 1_000_000)
            work.long_parts = 3
            await received.put("admitted")
            await received.put(await connection.recv())

        limits = Limits()
        port = ServerPort(Entrance(limits, most=5, log=logging.getLogger("test")), limits)
        number = await port.open(
            "127.0.0.1",
            0,
            attend=attend,
            answer=lambda *_: None,
            max_bytes=1_000_000,
            connection_class=make,  # type: ignore[arg-type]  # a function that makes one
        )
        async with connect(f"ws://127.0.0.1:{number}", compression=None) as client:
            assert await asyncio.wait_for(received.get(), 30) == "admitted"
            await client.send(MESSAGE)
            assert await asyncio.wait_for(received.get(), 30) == MESSAGE
        await port.close()

        assert connections[0].sizes == [PART_BYTES[1] // 4, PART_BYTES[0], PART_BYTES[0]]

    asyncio.run(run())
