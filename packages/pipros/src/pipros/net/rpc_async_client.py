"""The XML-RPC client for use inside an asyncio loop."""

from __future__ import annotations

import asyncio
import itertools
from typing import Any, Final

from pipros.basics.errors import ProtocolError, Unreachable
from pipros.basics.limits import process_limits
from pipros.net.address import address_here, host_and_port, split_uri
from pipros.net.rpc_client import reason_of
from pipros.wire.http import HttpError, Response, ResponseReader, request_head
from pipros.wire.xmlrpc import decode_response, encode_call

_SLICE_BYTES: Final = 256 * 1024
"""Number of bytes of a large document that are written to the socket at a time."""


async def call_async(
    uri: str, method: str, *params: Any, timeout_s: float | None, answer_limit_bytes: int | None = None
) -> Any:
    """Call one method over a new connection.

    The result and the errors are those of `RpcClient.call`. A malformed `uri` raises ValueError.
    """
    client = AsyncRpcClient(uri, answer_limit_bytes=answer_limit_bytes)
    try:
        return await client.call(method, *params, timeout_s=timeout_s)
    finally:
        client.close()


class AsyncRpcClient:
    """Calls methods on one XML-RPC server over a connection that is kept open.

    Only one call may run at a time, so tasks that share a client must queue their calls. A connection that
    the server has closed is silently replaced.
    """

    def __init__(self, uri: str, *, answer_limit_bytes: int | None = None) -> None:
        """Store the settings; the first call connects.

        Args:
            uri: `http://HOST:PORT/`.
            answer_limit_bytes: the maximum size of a response. Defaults to `Limits.body_bytes`, because the
                server's address comes from a peer, so the server is not trusted.

        Raises:
            ValueError: `uri` does not have the form `http://HOST:PORT/`.
        """
        self.uri = uri
        self._answer_limit_bytes = answer_limit_bytes or process_limits().body_bytes
        self._host, self._port, self._path = split_uri(uri)
        self._connection: _AsyncConnection | None = None

    async def call(self, method: str, *params: Any, timeout_s: float | None) -> Any:
        """Call `method` and return its value. Raises the same errors as `RpcClient.call`."""
        return await self.post(encode_call(method, params), timeout_s=timeout_s)

    async def post(self, document: bytes, *, timeout_s: float | None) -> Any:
        """Like `call`, but take an encoded request, which can be sent to many servers."""
        head = request_head(host_and_port(self._host, self._port), self._path, len(document))
        try:
            response = await self._exchange(head, document, timeout_s)
        except HttpError as error:
            self.close()
            raise ProtocolError(f"{self.uri} does not speak XML-RPC: {error}") from None
        except asyncio.TimeoutError:
            self.close()
            raise Unreachable(self.uri, "no response in time") from None
        except OSError as error:
            self.close()
            raise Unreachable(self.uri, reason_of(error)) from error
        except BaseException:
            self.close()
            raise
        if not response.keep_alive:
            self.close()
        if response.status != 200:
            raise ProtocolError(f"{self.uri} responded with {response.status} {response.reason}")
        return decode_response(response.body, limit_bytes=self._answer_limit_bytes)

    async def wait_while_connected(self, timeout_s: float) -> None:
        """Return when no connection is open, as after the end of the server, or after `timeout_s`."""
        if self._connection:
            await asyncio.wait([self._connection.lost], timeout=timeout_s)

    def close(self) -> None:
        """Close the connection if it is open. The next call reconnects."""
        connection, self._connection = self._connection, None
        if connection:
            connection.close()

    async def _exchange(self, head: bytes, document: bytes, timeout_s: float | None) -> Response:
        loop = asyncio.get_running_loop()
        deadline = None if timeout_s is None else loop.time() + timeout_s
        kept = self._connection
        if kept:
            try:
                return await kept.exchange(head, document, deadline)
            except ConnectionError:
                self.close()
                if kept.has_answer_begun:
                    raise
        connecting = loop.create_connection(
            lambda: _AsyncConnection(loop, self._answer_limit_bytes), *address_here(self._host, self._port)
        )
        _, connection = await asyncio.wait_for(connecting, timeout_s)
        self._connection = connection
        return await connection.exchange(head, document, deadline)


class _AsyncConnection(asyncio.Protocol):
    def __init__(self, loop: asyncio.AbstractEventLoop, answer_limit_bytes: int) -> None:
        self._loop = loop
        self._reader = ResponseReader(body_limit=answer_limit_bytes)
        self._transport: asyncio.Transport | None = None
        self._answer: asyncio.Future[Response] | None = None
        self._may_write = asyncio.Event()
        self._may_write.set()
        self.has_answer_begun = False
        self.lost: asyncio.Future[None] = loop.create_future()

    async def exchange(self, head: bytes, document: bytes, deadline: float | None) -> Response:
        """Send a request and wait for its response.

        Raises:
            ConnectionError: the connection was closed before or during the exchange.
            TimeoutError: the response did not arrive by the deadline.
            HttpError: the response is malformed or too large.
        """
        self.has_answer_begun = False
        if self._transport is None or self._transport.is_closing():
            raise ConnectionResetError("connection closed before the response")
        answer: asyncio.Future[Response] = self._loop.create_future()
        self._answer = answer
        timer = None if deadline is None else self._loop.call_at(deadline, self._fail, TimeoutError())
        try:
            if len(document) <= _SLICE_BYTES:
                self._transport.write(head + document)
                return await answer
            is_sent = await self._send_slices(head, document, answer)
            response = await answer
            return response if is_sent else response._replace(keep_alive=False)
        finally:
            self._answer = None
            if timer:
                timer.cancel()

    async def _send_slices(self, head: bytes, document: bytes, answer: asyncio.Future[Response]) -> bool:
        """Send as fast as the peer reads.

        Return False if the connection ends, the response arrives or the deadline passes before everything
        is sent.
        """
        slices = (document[start : start + _SLICE_BYTES] for start in range(0, len(document), _SLICE_BYTES))
        for piece in itertools.chain([head], slices):
            await self._may_write.wait()
            if answer.done() or self._transport is None:
                return False
            self._transport.write(piece)
            await asyncio.sleep(0)
        return True

    def close(self) -> None:
        if self._transport:
            self._transport.abort()

    def pause_writing(self) -> None:
        self._may_write.clear()

    def resume_writing(self) -> None:
        self._may_write.set()

    def _fail(self, error: Exception) -> None:
        self._may_write.set()
        if self._answer and not self._answer.done():
            self._answer.set_exception(error)

    def _succeed(self, response: Response | None) -> None:
        self._may_write.set()
        if response and self._answer and not self._answer.done():
            self._answer.set_result(response)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  # a TCP client makes no others
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        if self._answer is None or self._answer.done():
            self.close()  # the server sent unexpected bytes
            return
        self.has_answer_begun = True
        try:
            self._succeed(self._reader.feed(data))
        except HttpError as error:
            self._fail(error)

    def eof_received(self) -> None:
        try:
            self._succeed(self._reader.end())
        except HttpError:
            self._fail(ConnectionResetError("connection closed in the middle of the response"))

    def connection_lost(self, error: Exception | None) -> None:
        self._transport = None
        if not self.lost.done():
            self.lost.set_result(None)
        lost = error if isinstance(error, ConnectionError) else None
        self._fail(lost or ConnectionResetError("connection closed before the response"))
