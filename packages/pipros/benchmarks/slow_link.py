"""A slow link to a local port: a forwarder in a thread, with a limited rate, a delay and a short queue."""

import asyncio
import contextlib
import socket
import threading

PIECE_BYTES = 8192
QUEUE_BYTES = 65536


class SlowLink:
    """Forwards connections to a local port.

    Attributes:
        port: the port on which it listens.
    """

    def __init__(self, target, bytes_per_s, delay_s):
        """Start forwarding.

        Args:
            target: the port to which connections are forwarded.
            bytes_per_s: the rate of each direction, which all connections share.
            delay_s: the delay of each direction.
        """
        self._target, self._bytes_per_s, self._delay_s = target, bytes_per_s, delay_s
        self._free_s = {"up": 0.0, "down": 0.0}
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._ready.wait(10)

    def close(self):
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def _run(self):
        listener = socket.create_server(("127.0.0.1", 0))
        # The queue is short, like that of a modem. Large kernel buffers would hide the limited rate.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, QUEUE_BYTES)
        self.port = listener.getsockname()[1]
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._serve, sock=listener))
        self._ready.set()
        self._loop.run_forever()
        server.close()
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        if tasks:
            self._loop.run_until_complete(asyncio.wait(tasks))
        self._loop.close()

    async def _serve(self, reader, writer):
        with contextlib.suppress(asyncio.CancelledError):  # of `close`; asyncio would log it
            await self._forward(reader, writer)

    async def _forward(self, reader, writer):
        made = socket.socket()
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, QUEUE_BYTES)
        made.setblocking(False)
        await self._loop.sock_connect(made, ("127.0.0.1", self._target))
        far_reader, far_writer = await asyncio.open_connection(sock=made, limit=QUEUE_BYTES)
        await asyncio.gather(
            self._pass("up", reader, far_writer),
            self._pass("down", far_reader, writer),
            return_exceptions=True,
        )

    async def _pass(self, direction, reader, writer):
        waiting = asyncio.Queue()
        sending = self._loop.create_task(self._send(waiting, writer))
        with contextlib.suppress(OSError):
            while piece := await reader.read(PIECE_BYTES):
                now = self._loop.time()
                free = max(now, self._free_s[direction]) + len(piece) / self._bytes_per_s
                self._free_s[direction] = free
                await asyncio.sleep(free - now)
                waiting.put_nowait((self._loop.time() + self._delay_s, piece))
        waiting.put_nowait(None)
        await sending

    async def _send(self, waiting, writer):
        with contextlib.suppress(OSError):
            while (entry := await waiting.get()) is not None:
                due, piece = entry
                await asyncio.sleep(due - self._loop.time())
                writer.write(piece)
                await writer.drain()
        writer.close()
