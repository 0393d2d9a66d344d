"""The port of bridges: which clients are admitted, and how a misbehaving client affects the others."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import json
import logging
import socket
import ssl
import sys
import zlib
from collections.abc import AsyncIterator, Coroutine, Hashable, Mapping, Sequence
from typing import Any

import pytest
from websockets import Origin
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Subprotocol

from pipros.basics.limits import Limits
from pipros_bridges.admission import Admission
from pipros_bridges.bridge_server import BridgeServer
from pipros_bridges.client import BridgeClient
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import WebSocketFrame, text_frame
from pipros_server.secret import Secret
from tests.support.constants import Constants
from tests.support.environments import file_of_tests
from tests.support.waiting import wait_until

TOKEN = "-".join(["a", "token", "of", "16", "characters"])
PROTOCOL = "echo.v1"
CERTIFICATES = file_of_tests("support/certificates")


class Echo:
    """A session that sends each message back, and a handler of such sessions."""

    def __init__(self) -> None:
        self.sessions: list[Echo] = []
        self.is_closed = False
        self.is_unused = False
        self.worked_s = 0.0
        self.client: BridgeClient

    def open(self, client: BridgeClient) -> Echo:
        session = Echo()
        session.client = client
        client.outbox.open("topic")
        self.sessions.append(session)
        return session

    def is_login(self, first: str | bytes) -> bool:
        return first == "let me in"

    async def receive(self, data: str | bytes) -> None:
        if data == "defect":
            raise RuntimeError("a defect")
        self.client.send(text_frame(data) if isinstance(data, str) else WebSocketFrame((data[:1], data[1:])))

    def takes(self) -> Mapping[Hashable, str]:
        return {"topic": "/chatter"}

    def sends(self) -> Sequence[str]:
        return ["/command"]

    def close(self) -> None:
        self.is_closed = True


@contextlib.asynccontextmanager
async def opened(
    admission: Admission | None = None,
    limits: Limits | None = None,
    handler: Echo | None = None,
    *,
    has_control: bool = True,
) -> AsyncIterator[BridgeServer]:
    server = BridgeServer(
        {PROTOCOL: handler or Echo()}, admission or Admission(), limits=limits, has_control=has_control
    )
    await server.open("127.0.0.1", 0)
    try:
        yield server
    finally:
        await server.close()


def connected(server: BridgeServer, path: str = "/", **options: Any) -> connect:
    options = {"subprotocols": [PROTOCOL], "max_size": None, **options}
    return connect(f"ws://127.0.0.1:{server.port}{path}", proxy=None, open_timeout=30, **options)


async def condition(check: Any) -> None:
    """Wait for a condition in the loop of the server."""
    await asyncio.to_thread(wait_until, check)


def run(body: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(body, 60))


def test_messages_of_any_size_arrive_in_order() -> None:
    async def body() -> None:
        async with opened() as server, connected(server) as client:
            sent = ["", "é" * 60, "x" * 126, "y" * 70_000, b"\1" * 200, b"\2" * 17_000, b"\3" * 3_000_000]
            for message in sent:
                await client.send(message)
            assert [await client.recv() for _ in sent] == sent

    run(body())


@pytest.mark.parametrize("is_encrypted", [False, True])
def test_control_frames_wait_for_the_end_of_a_large_message(is_encrypted: bool) -> None:
    async def body() -> None:
        handler = Echo()
        server = BridgeServer(
            {PROTOCOL: handler},
            Admission(),
            limits=Limits(tables=(BridgeLimits(bridge_queue_bytes=100_000_000),)),
        )
        tls = None
        if is_encrypted:
            tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            tls.load_cert_chain(CERTIFICATES / "cert.pem", CERTIFICATES / "key.pem")
        await server.open("127.0.0.2", 0, tls=tls)
        scheme = "wss" if is_encrypted else "ws"
        trusting = ssl.create_default_context(cafile=str(CERTIFICATES / "cert.pem")) if is_encrypted else None
        async with connect(
            f"{scheme}://127.0.0.2:{server.port}",
            subprotocols=[Subprotocol(PROTOCOL)],
            ssl=trusting,
            proxy=None,
            max_size=None,
            open_timeout=30,
        ) as client:
            await condition(lambda: handler.sessions)
            outbox = handler.sessions[0].client.outbox
            client.transport.pause_reading()
            large = bytes(range(256)) * 40_000
            for number in range(2):  # more than the buffers of the system take
                outbox.put("topic", WebSocketFrame((b"%d" % number, large)), WebSocketFrame((b"|", large)))
            pong = await client.ping()
            client.transport.resume_reading()
            for number in range(2):
                assert await client.recv() == b"%d" % number + large
                assert await client.recv() == b"|" + large
            await pong
        await server.close()

    run(body())


@pytest.mark.parametrize("path", ["/", f"/{TOKEN}x"])
def test_a_client_without_the_token_is_turned_away(path: str) -> None:
    async def body() -> None:
        handler = Echo()
        async with opened(Admission(Secret(tokens=[TOKEN])), handler=handler) as server:
            async with connected(server, path) as client:
                await client.send("open sesame")
                with pytest.raises(ConnectionClosed) as closed:
                    await client.recv()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
            assert not handler.sessions

    run(body())


@pytest.mark.parametrize(("path", "headers", "first"), [
    (f"/{TOKEN}", {}, None), (f"/?token={TOKEN}", {}, None),
    ("/", {"Authorization": f"Bearer {TOKEN}"}, None), ("/", {}, json.dumps({"token": TOKEN})),
    ("/", {}, "let me in"),
])  # fmt: skip
def test_a_client_with_the_token_enters(path: str, headers: dict[str, str], first: str | None) -> None:
    async def body() -> None:
        async with (
            opened(Admission(Secret(tokens=[TOKEN]))) as server,
            connected(server, path, additional_headers=headers) as client,
        ):
            if first is not None:
                await client.send(first)
            await client.send("hello")
            assert await client.recv() == "hello"

    run(body())


def test_a_silent_stranger_is_disconnected() -> None:
    async def body() -> None:
        limits = Limits(login_s=2.0)  # it also limits the opening handshake
        async with opened(Admission(Secret(tokens=[TOKEN])), limits) as server, connected(server) as client:
            with pytest.raises(ConnectionClosed):
                await client.recv()

    run(body())


def test_a_stranger_cannot_send_much(constants: Constants) -> None:
    async def body() -> None:
        constants(LOGIN_BYTES=10000)
        async with opened(Admission(Secret(tokens=[TOKEN])), Limits()) as server, connected(server) as client:
            with contextlib.suppress(ConnectionClosed):
                await client.send("x" * 1_000_000)
            with pytest.raises(ConnectionClosed):
                await client.recv()

    run(body())


def test_a_page_of_another_site_cannot_connect() -> None:
    async def body() -> None:
        async with opened() as server:
            with pytest.raises(InvalidStatus) as refused:
                await connected(server, origin=Origin("https://evil.example"))
            assert refused.value.response.status_code == 403
            assert b"https://evil.example may not connect" in (refused.value.response.body or b"")
            async with connected(server, origin=Origin("http://localhost:3000")) as client:
                await client.send("hello")
                assert await client.recv() == "hello"

    run(body())


@pytest.mark.parametrize("offered", [None, ["something.else"]])
def test_unknown_subprotocols_are_refused(offered: Any) -> None:
    async def body() -> None:
        async with opened() as server:
            with pytest.raises(InvalidStatus) as refused:
                await connected(server, subprotocols=offered)
            assert refused.value.response.status_code == 400
            assert PROTOCOL.encode() in (refused.value.response.body or b"")

    run(body())


def test_a_client_that_never_reads_costs_the_others_nothing_and_is_disconnected(constants: Constants) -> None:
    async def body() -> None:
        handler = Echo()
        constants(BRIDGE_STALL_S=1.0)
        limits = Limits(tables=(BridgeLimits(bridge_queue_bytes=1_000_000),))
        async with opened(limits=limits, handler=handler) as server, connected(server) as stuck:
            await condition(lambda: handler.sessions)
            first = handler.sessions[0]
            stuck.transport.pause_reading()
            async with connected(server) as other:
                await condition(lambda: len(handler.sessions) == 2)
                second = handler.sessions[1]
                for _ in range(20):  # more than its queue, before it may be disconnected
                    first.client.outbox.put("topic", WebSocketFrame((b"x" * 100_000,)))
                for number in range(200):
                    frame = WebSocketFrame((b"%d" % number, b"x" * 100_000))
                    first.client.outbox.put("topic", frame)
                    second.client.outbox.put("topic", frame)
                    assert await other.recv() == b"".join(frame.parts)
                assert first.client.outbox.waiting_bytes <= 1_000_000
                assert first.client.outbox.total.lost > 0
                await condition(lambda: first.is_closed)
                await other.send("still here")
                assert await other.recv() == "still here"

    run(body())


def test_writing_to_a_client_that_has_vanished_logs_nothing(caplog: pytest.LogCaptureFixture) -> None:
    async def body() -> None:
        handler = Echo()
        limits = Limits(tables=(BridgeLimits(bridge_queue_bytes=100_000_000),))
        async with opened(limits=limits, handler=handler) as server, connected(server) as client:
            await condition(lambda: handler.sessions)
            client.transport.get_extra_info("socket").shutdown(socket.SHUT_RDWR)
            handler.sessions[0].client.outbox.put("topic", WebSocketFrame((bytes(50_000_000),)))
            await condition(lambda: handler.sessions[0].is_closed)

    run(body())
    assert not caplog.records


def test_a_client_that_does_not_read_its_answers_is_disconnected() -> None:
    async def body() -> None:
        handler = Echo()
        limits = Limits(tables=(BridgeLimits(bridge_queue_bytes=100_000),))
        async with opened(limits=limits, handler=handler) as server, connected(server) as client:
            await condition(lambda: handler.sessions)
            client.transport.pause_reading()
            for _ in range(500):
                handler.sessions[0].client.send(WebSocketFrame((b"x" * 90_000,)))
            assert handler.sessions[0].client.outbox.is_overrun
            await condition(lambda: handler.sessions[0].is_closed)

    run(body())


def test_a_message_that_is_too_large_ends_the_connection() -> None:
    async def body() -> None:
        async with (
            opened(limits=Limits(tables=(BridgeLimits(bridge_message_bytes=100_000),))) as server,
            connected(server) as client,
        ):
            await client.send("x" * 200_000)
            with pytest.raises(ConnectionClosed) as closed:
                await client.recv()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1009

    run(body())


def test_a_deflate_bomb_is_not_decompressed() -> None:
    async def body() -> None:
        async with opened() as server, connected(server, compression="deflate") as client:
            assert client.protocol.extensions == []

    run(body())


def test_a_compressed_frame_ends_the_connection() -> None:
    async def body() -> None:
        async with opened() as server, connected(server) as client:
            bomb = zlib.compress(bytes(50_000), wbits=-15)
            client.transport.write(b"\xc2" + bytes([0x80 | len(bomb)]) + bytes(4) + bomb)
            with pytest.raises(ConnectionClosed) as closed:
                await client.recv()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1002

    run(body())


def test_too_many_clients_are_refused() -> None:
    async def body() -> None:
        async with (
            opened(limits=Limits(tables=(BridgeLimits(bridge_clients=1),))) as server,
            connected(server) as first,
        ):
            await first.send("hello")
            await first.recv()
            async with connected(server) as second:
                with pytest.raises(ConnectionClosed, match="bridge_clients"):
                    await second.recv()

    run(body())


def test_a_defect_ends_the_client_that_met_it_only(caplog: pytest.LogCaptureFixture) -> None:
    async def body() -> None:
        handler = Echo()
        async with opened(handler=handler) as server, connected(server) as client, connected(server) as other:
            await client.send("defect")
            with pytest.raises(ConnectionClosed):
                await client.recv()
            await other.send("hello")
            assert await other.recv() == "hello"
            await condition(lambda: any(session.is_closed for session in handler.sessions))

    run(body())
    assert "a defect" in caplog.text


def test_half_open_connections_leave_room_for_others(constants: Constants) -> None:
    async def body() -> None:
        constants(HANDSHAKES=5)
        limits = Limits(tables=(BridgeLimits(bridge_clients=5),))
        async with opened(limits=limits) as server:
            with contextlib.ExitStack() as stack:
                for _ in range(50):
                    stack.enter_context(socket.create_connection(("127.0.0.1", server.port)))
                async with connected(server) as client:
                    await client.send("hello")
                    assert await client.recv() == "hello"

    run(body())


def get(server: BridgeServer, path: str, headers: dict[str, str]) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
    with contextlib.closing(connection):
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read()


def test_the_list_of_clients_has_what_each_takes_and_lost() -> None:
    async def body() -> None:
        handler = Echo()
        agent = "robot app"
        async with opened(handler=handler) as server, connected(server, user_agent_header=agent) as client:
            await client.send("hello")
            await client.recv()
            handler.sessions[0].client.outbox.put("topic", WebSocketFrame((b"12345",)))
            await client.recv()
            status, text = await asyncio.to_thread(get, server, "/clients", {})
            assert status == 200
            [row] = json.loads(text)
            assert (row["agent"], row["protocol"], row["publishes"]) == (agent, PROTOCOL, ["/command"])
            assert row["received"] == {"messages": 1, "bytes": 5, "lost": 0}
            assert row["topics"] == {"/chatter": {"messages": 1, "bytes": 5, "lost": 0}}
            status, _ = await asyncio.to_thread(get, server, "/clients", {"Host": "evil.example"})
            assert status == 403
            assert (await asyncio.to_thread(get, server, "/", {}))[0] == 426
        async with opened(Admission(Secret(tokens=[TOKEN]))) as server:
            assert (await asyncio.to_thread(get, server, "/clients", {}))[0] == 403
            bearer = {"Authorization": f"Bearer {TOKEN}"}
            assert await asyncio.to_thread(get, server, "/clients", bearer) == (200, b"[]")

    run(body())


def test_tokens_are_not_logged(caplog: pytest.LogCaptureFixture) -> None:
    async def body() -> None:
        silent = logging.Logger("client")
        async with (
            opened(Admission(Secret(tokens=[TOKEN]))) as server,
            connected(server, f"/{TOKEN}", logger=silent) as client,
        ):
            await client.send("defect")
            with pytest.raises(ConnectionClosed):
                await client.recv()

    with caplog.at_level(logging.DEBUG):
        run(body())
    assert TOKEN not in caplog.text


def masked(opcode: int, data: bytes, size: int | None = None) -> bytes:
    """Return a client's frame with a mask of zeros. `size` is the announced size, if not the real one."""
    size = len(data) if size is None else size
    length = bytes([0x80 | size]) if size < 126 else b"\xff" + size.to_bytes(8, "big")
    return bytes([opcode]) + length + bytes(4) + data


FRAGMENT, CONTINUATION, LAST, TEXT = 0x01, 0x00, 0x80, 0x81


async def raw(server: BridgeServer) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Connect without a WebSocket library, to send invalid or incomplete frames."""
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    writer.write(
        b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Protocol: echo.v1\r\n\r\n"
    )
    await reader.readuntil(b"\r\n\r\n")
    return reader, writer


async def sent_until_cut(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, data: bytes) -> bytes:
    """Send data repeatedly until the server ends the connection; return what the server said."""
    with contextlib.suppress(ConnectionError):
        while not reader.at_eof() and not writer.is_closing():
            writer.write(data)
            await writer.drain()
            if reader._buffer:  # type: ignore[attr-defined] # the close frame
                break
    with contextlib.suppress(ConnectionError):
        return await reader.read(1000)
    return b""


@pytest.mark.parametrize("frame", [masked(CONTINUATION, b""), masked(CONTINUATION, b"x" * 1000)])
def test_a_message_without_end_is_cut_before_it_fills_the_memory(frame: bytes) -> None:
    async def body() -> None:
        limits = Limits(tables=(BridgeLimits(bridge_message_bytes=1_000_000),))
        async with opened(limits=limits) as server:
            shares = server.shares
            reader, writer = await raw(server)
            writer.write(masked(FRAGMENT, b"begin"))
            said = await sent_until_cut(reader, writer, frame * 100)
            assert b"exceeds" in said or not said
            await condition(lambda: shares.memory.used == 0)
            assert shares.memory.peak <= 4_000_000
            writer.close()

    run(body())


def test_incomplete_messages_of_all_clients_share_the_memory_and_return_it(constants: Constants) -> None:
    async def body() -> None:
        constants(BRIDGE_CLIENT_BYTES=1000000, BRIDGE_TOTAL_BYTES=8000000)
        limits = Limits(tables=(BridgeLimits(bridge_message_bytes=1_000_000, bridge_queue_bytes=1_000_000),))
        async with opened(limits=limits) as server, connected(server) as other:
            clients = [await raw(server) for _ in range(20)]
            for _, writer in clients:
                writer.write(masked(TEXT, b"x" * 900_000, 950_000))
            await condition(lambda: server.shares.memory.used > 3_000_000)
            assert server.shares.memory.peak <= 8_000_000
            await other.send("y" * 100_000)
            assert await other.recv() == "y" * 100_000
            for _, writer in clients:
                writer.transport.abort()
            await condition(lambda: server.shares.memory.used == 0)

    run(body())


@pytest.mark.parametrize("part", [masked(FRAGMENT, b"begin"), masked(TEXT, b"x" * 100, 1000)])
def test_an_incomplete_message_must_end_in_time(part: bytes, constants: Constants) -> None:
    async def body() -> None:
        constants(WHOLE_REQUEST_S=0.3)
        async with opened(limits=Limits()) as server:
            reader, writer = await raw(server)
            writer.write(part)
            assert b"did not arrive in time" in await reader.read(1000)
            writer.close()

    run(body())


def test_a_slow_session_stops_the_reading_but_loses_no_message() -> None:
    class Slow(Echo):
        def open(self, client: BridgeClient) -> Echo:
            session = Slow()
            session.client = client
            return session

        async def receive(self, data: str | bytes) -> None:
            await release.wait()
            await super().receive(data[:10])

    release = asyncio.Event()

    async def body() -> None:
        async with opened(handler=Slow()) as server, connected(server) as client:
            sending = [
                asyncio.create_task(client.send(f"{number:010}" + "x" * 200_000)) for number in range(50)
            ]
            # Two messages are read in any case, of which the first 256 KiB are the client's own.
            await condition(lambda: server.shares.memory.peak > 100_000)
            assert server.shares.memory.peak < 2_000_000
            release.set()
            assert [await client.recv() for _ in range(50)] == [f"{number:010}" for number in range(50)]
            await asyncio.gather(*sending)

    run(body())


@pytest.mark.skipif(
    sys.platform != "linux", reason="other systems tell that a client has left when it is read"
)
@pytest.mark.parametrize("has_control", [False, True])
def test_only_requests_that_change_the_system_are_handled_after_a_client_left(has_control: bool) -> None:
    class Slow(Echo):
        def open(self, client: BridgeClient) -> Echo:
            self.sessions.append(self)
            self.client = client
            return self

        async def receive(self, data: str | bytes) -> None:
            received.append(data)
            await release.wait()

    received: list[str | bytes] = []
    release, handler = asyncio.Event(), Slow()

    async def body() -> None:
        async with opened(handler=handler, has_control=has_control) as server:
            _, writer = await raw(server)
            writer.transport.set_write_buffer_limits(0)
            writer.write(masked(TEXT, b"x" * 100) * 3000)
            await writer.drain()
            await condition(lambda: server.shares.memory.peak > 0)
            writer.transport.abort()
            await condition(lambda: handler.client.has_left)
            release.set()
            await condition(lambda: handler.is_closed)
            assert len(received) == (3000 if has_control else 1)
            assert handler.client.outbox.is_closed

    run(body())


def test_a_client_that_uses_nothing_makes_room_for_another() -> None:
    async def body() -> None:
        handler = Echo()
        async with (
            opened(limits=Limits(tables=(BridgeLimits(bridge_clients=2),)), handler=handler) as server,
            connected(server) as first,
            connected(server) as second,
        ):
            for client in (first, second):
                await client.send("hello")
                await client.recv()
            handler.sessions[1].is_unused = True
            async with connected(server) as third:
                await third.send("hello")
                assert await third.recv() == "hello"
                with pytest.raises(ConnectionClosed, match="to make room for a new client"):
                    await second.recv()
            await first.send("still here")
            assert await first.recv() == "still here"

    run(body())
