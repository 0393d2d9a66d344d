"""The server of the page: access, limits for unauthenticated clients, and shutdown."""

import asyncio
import contextlib
import fcntl
import json
import logging
import signal
import socket
import ssl
import struct
import sys
import termios
import time
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import ExitStack
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from websockets import Origin
from websockets.client import ClientProtocol
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.uri import parse_uri

from pipros.net import sockets
from pipros.net.loop import BackgroundLoop
from pipros_server.access import Access
from pipros_server.view_server import PART_BYTES, PageServer, ServedViews
from tests.support.environments import file_of_tests
from tests.support.page import LivePage, Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

CERTIFICATES = file_of_tests("support/certificates")
TLS = ("--cert", CERTIFICATES / "cert.pem", "--key", CERTIFICATES / "key.pem")
AT_ONCE_S = 9.0
"""Half a second is promised; this test looks for waits of ten seconds and more."""

CAMERA = """
import rospy
from sensor_msgs.msg import Image
rospy.init_node("camera")
images = rospy.Publisher("image", Image, queue_size=2)
image = Image(width=1000, height=1000, step=3000, encoding="rgb8", data=bytes(3000000))
rate = rospy.Rate(30)
while not rospy.is_shutdown():
    images.publish(image)
    rate.sleep()
"""
HANGS_AT_ITS_END = """
import time
from pipros_page import serve_page
def close(system):
    print("closing", flush=True)
    time.sleep(100)
serve_page.WatchedSystem.close = close
serve_page.serve_page(serve_page.PageOptions(opens_browser=False))
"""
BLOCKS = """
import time
from pipros_page import serve_page
async def about(_):
    print("blocked", flush=True)
    time.sleep(100)
serve_page.served_views = lambda *_, **__: serve_page.ServedViews({}, {"about": about})
serve_page.serve_page(serve_page.PageOptions(opens_browser=False))
"""


class Strangers:
    """Connections to a page that send the given bytes, and read only on request."""

    def __init__(self) -> None:
        self.open = ExitStack()

    def connect(self, page: Page, data: bytes = b"") -> socket.socket:
        """A connection that has sent some bytes."""
        host, _, port = page.host.rpartition(":")
        peer = socket.create_connection((host, int(port)), 30)
        self.open.enter_context(peer)
        peer.sendall(data)
        return peer

    def stalled_browser(self, page: Page, **request: Any) -> socket.socket:
        """A browser that has logged in and requested a view, and then stops reading."""
        client = ClientProtocol(parse_uri(f"ws://{page.host}/live"), origin=Origin(f"http://{page.host}"))
        client.send_request(client.connect())
        peer = self.connect(page, b"".join(client.data_to_send()))
        while not client.events_received():
            client.receive_data(peer.recv(4096))
        for values in ({"token": page.token}, {"id": 1, **request}):
            client.send_text(json.dumps(values).encode())
        peer.sendall(b"".join(client.data_to_send()))
        return peer


@pytest.fixture
def strangers() -> Iterator[Strangers]:
    found = Strangers()
    yield found
    found.open.close()


def unread_bytes(peer: socket.socket) -> int:
    return int(struct.unpack("i", fcntl.ioctl(peer, termios.FIONREAD, bytes(4)))[0])


def has_ended(peer: socket.socket) -> bool:
    """Return whether the other side closes the connection within a time limit."""
    try:
        return not peer.recv(1)
    except ConnectionResetError:
        return True


def close_code(socket: ClientConnection) -> int:
    """Return the code with which the server closed a WebSocket."""
    with pytest.raises(ConnectionClosed) as closed:
        socket.recv(timeout=30)
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


def served(ros: RosSystem, *options: Any, **more: Any) -> Page:
    """Serve a page, with a master."""
    ros.serve_master()
    return Page(ros, *options, **more)


# ---- shutdown


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_browser_that_does_not_read_does_not_delay_shutdown(
    ros: RosSystem, strangers: Strangers, number: signal.Signals
) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", CAMERA)
    ros.wait_for_publisher("/image")
    page = Page(ros)
    browser = strangers.stalled_browser(page, view="image", args={"name": "/image"})
    seen = [0]

    def is_full() -> bool:
        seen.append(unread_bytes(browser))
        return seen[-1] > 0 and len(seen) > 10 and len(set(seen[-10:])) == 1

    wait_until(is_full, 60, "a browser whose buffers are full")
    page.process.send_signal(number)
    assert page.process.wait(AT_ONCE_S) == 0


def test_a_hung_service_does_not_delay_shutdown(ros: RosSystem, strangers: Strangers) -> None:
    page = served(ros)
    with socket.create_server(("127.0.0.1", 0)) as service, page.connect() as browser:
        uri = f"rosrpc://127.0.0.1:{service.getsockname()[1]}"
        with ServerProxy(ros.master_uri) as master:
            master.registerService("/mute", "/mute/get_loggers", uri, "http://127.0.0.1:9")
        browser.socket.send(json.dumps({"id": 1, "action": "loggers", "args": {"name": "/mute"}}))
        strangers.open.enter_context(service.accept()[0])
        page.process.press_ctrl_c()
        assert page.process.wait(AT_ONCE_S) == 0


def test_an_action_that_blocks_the_loop_does_not_delay_shutdown(ros: RosSystem) -> None:
    page = served(ros, command=sys.executable, prefix=("sh", "-c", 'exec "$1" -c "$0"', BLOCKS))
    with page.connect() as browser:
        browser.socket.send(json.dumps({"id": 1, "action": "about"}))
        page.process.wait_for("blocked")
        page.process.press_ctrl_c()
        assert page.process.wait(AT_ONCE_S) == 0


def test_silent_connections_do_not_delay_shutdown(ros: RosSystem, strangers: Strangers) -> None:
    page = served(ros, PIPROS_LIMITS="login_s=100")
    for data in (b"", b"GET / HTTP/1.1\r\n", b"GET /live HTTP/1.1\r\n"):
        strangers.connect(page, data)
    with page.connect(first="") as browser, contextlib.suppress(ConnectionClosed):
        assert close_code(browser.socket) == 1008  # by now the others have been accepted
    page.process.press_ctrl_c()
    assert page.process.wait(AT_ONCE_S) == 0


def test_unfinished_tls_handshakes_do_not_delay_shutdown(ros: RosSystem, strangers: Strangers) -> None:
    page = served(ros, *TLS, PIPROS_LIMITS="login_s=100")
    for data in (b"", b"\x16\x03\x01\x02\x00"):
        strangers.connect(page, data)
    answered(page)
    page.process.press_ctrl_c()
    assert page.process.wait(AT_ONCE_S) == 0


def test_a_second_signal_ends_the_process_at_once(ros: RosSystem) -> None:
    ros.serve_master()
    page = ros.pipros.start(sys.executable, "-c", HANGS_AT_ITS_END)
    page.wait_for("#token=")
    page.send_signal(signal.SIGINT)
    page.wait_for("closing")
    page.send_signal(signal.SIGTERM)
    assert page.wait(AT_ONCE_S) == -signal.SIGTERM


# ---- unauthenticated clients


def answered(page: Page) -> None:
    """Complete a TLS handshake with the page, after all that were started before."""
    context = ssl.create_default_context(cafile=str(CERTIFICATES / "cert.pem"))
    context.check_hostname = False
    host, _, port = page.host.rpartition(":")
    with socket.create_connection((host, int(port)), 30) as plain, context.wrap_socket(plain):
        pass


def test_silent_connections_leave_room_for_browsers(ros: RosSystem, strangers: Strangers) -> None:
    page = served(ros, prefix=("sh", "-c", 'ulimit -n 256; exec "$@"', "sh"), PIPROS_LIMITS="login_s=100")
    for _ in range(400):
        strangers.connect(page)
    with page.connect() as browser:
        assert browser.act("about")["control"] is False
        for _ in range(400):
            strangers.connect(page)
        assert page.get("/app.js").status == 200
        assert browser.act("about")["control"] is False
    assert "Traceback" not in page.process.output
    assert len(page.process.lines) < 20


def test_a_page_without_descriptors_says_so_once(ros: RosSystem, strangers: Strangers) -> None:
    page = served(ros, prefix=("sh", "-c", 'ulimit -n 32; exec "$@"', "sh"), PIPROS_LIMITS="login_s=100")
    held = [strangers.connect(page) for _ in range(40)]
    page.process.wait_for("refused new connections: Too many open files")
    for peer in held:
        peer.close()
    with page.connect() as browser:
        assert browser.act("about")["control"] is False
    assert "Traceback" not in page.process.output


@pytest.mark.parametrize("data", [b"", b"GET / HTTP/1.1\r\nHost: localhost\r\n"])
def test_a_connection_without_a_request_is_closed(ros: RosSystem, strangers: Strangers, data: bytes) -> None:
    assert has_ended(strangers.connect(served(ros, PIPROS_LIMITS="login_s=0.2"), data))


@pytest.mark.parametrize("data", [b"", b"\x16\x03\x01\x02\x00"])
def test_an_unfinished_tls_handshake_is_ended(ros: RosSystem, strangers: Strangers, data: bytes) -> None:
    page = served(ros, *TLS, PIPROS_LIMITS="login_s=0.2")
    assert has_ended(strangers.connect(page, data))
    assert "Traceback" not in page.process.output


def test_a_websocket_without_the_token_is_closed(ros: RosSystem) -> None:
    page = served(ros, PIPROS_LIMITS="login_s=60")
    firsts = (
        "", "{", '{"token": "wrong"}', json.dumps({"id": 1, "action": "about"}),
        json.dumps({"token": page.token[:-1]}), json.dumps({"code": page.token}),
    )  # fmt: skip
    for first in firsts:
        with page.connect(first=first) as browser:
            assert close_code(browser.socket) == 1008


def test_a_websocket_without_a_first_message_is_asked_to_try_again(ros: RosSystem) -> None:
    page = served(ros, PIPROS_LIMITS="login_s=4")
    with connect(f"ws://{page.host}/live", origin=Origin(f"http://{page.host}"), proxy=None) as socket:
        assert close_code(socket) == 1013  # after 1008, a page forgets its token


def test_bytes_before_the_token_are_limited(ros: RosSystem) -> None:
    page = served(ros)
    with (
        pytest.raises(ConnectionClosed),
        page.connect(first=json.dumps({"padding": "x" * 100_000, "token": page.token})) as browser,
    ):
        browser.socket.recv(timeout=30)
    with page.connect() as browser:  # and not afterwards
        assert "unknown action" in browser.act("nothing")["error"]
        assert "unknown action" in browser.act("x" * 100_000)["error"]


def test_no_cookie_is_set_and_none_opens_anything(ros: RosSystem) -> None:
    page = served(ros, PIPROS_LIMITS="login_s=60")
    port = page.host.rpartition(":")[2]
    for path in ("/", f"/?token={page.token}"):
        answer = page.get(path, Cookie=f"pipros_{port}={page.token}")
        assert answer.status == 200
        assert answer.headers["Set-Cookie"] is None
        assert page.token.encode() not in answer.read()
    with connect(
        f"ws://{page.host}/live",
        origin=Origin(f"http://{page.host}"),
        additional_headers={"Cookie": f"pipros_{port}={page.token}"},
        proxy=None,
    ) as socket:
        socket.send(json.dumps({"id": 1, "action": "about"}))
        assert close_code(socket) == 1008


# ---- views that fail


@pytest.fixture
def serve(caplog: pytest.LogCaptureFixture) -> Iterator[Callable[[ServedViews], Access]]:
    """Serve views and actions of a test, and return an access to them."""
    with ExitStack() as stack:

        def start(served: ServedViews) -> Access:
            loop = BackgroundLoop("page")
            loop.start()
            stack.callback(loop.stop)
            server = PageServer(served)
            loop.run(server.start("127.0.0.1", 0), 30)
            stack.callback(lambda: loop.run(server.close(), 30))
            return server.access

        yield start


@contextlib.contextmanager
def browser_of(access: Access) -> Iterator[LivePage]:
    host = f"localhost:{access.port}"
    with connect(f"ws://{host}/live", origin=Origin(f"http://{host}"), proxy=None) as socket:
        socket.send(json.dumps({"token": access.secret.token}))
        yield LivePage(socket)


LARGE = {"text": "größer " * 3_000_000, "bytes": bytes(range(256)) * 80_000}


@pytest.mark.parametrize("kind", LARGE)
def test_a_large_message_comes_in_parts_between_which_others_are_sent(
    serve: Callable[[ServedViews], Access], kind: str
) -> None:
    """On a slow link, each part shows the page that the server is alive, and other answers need not wait."""

    async def large(_: Mapping[str, Any]) -> AsyncIterator[Any]:
        yield LARGE[kind]

    async def act(_: Mapping[str, Any]) -> str:
        return "done"

    with browser_of(serve(ServedViews({"large": large}, {"act": act}))) as browser:
        browser.socket.send(json.dumps({"id": 7, "view": "large"}))
        browser.socket.send(json.dumps({"id": 8, "action": "act"}))
        received = [browser.socket.recv(timeout=30)]
        while not (isinstance(received[-1], bytes) and received[-1][4]):
            received.append(browser.socket.recv(timeout=30))

    assert max(map(len, received)) <= PART_BYTES + 5
    assert any(isinstance(each, str) and json.loads(each) == {"id": 8, "data": "done"} for each in received)
    parts = [each for each in received if isinstance(each, bytes)]
    assert {part[:4] for part in parts} == {(2**31 + 7).to_bytes(4, "big")}
    whole = b"".join(part[5:] for part in parts)
    if kind == "text":
        assert (parts[-1][4], json.loads(whole)) == (1, {"id": 7, "data": LARGE["text"]})
    else:
        assert parts[-1][4] == 2
        assert whole == (7).to_bytes(4, "big") + LARGE["bytes"]


def nested(depth: int) -> Any:
    value: Any = 0
    for _ in range(depth):
        value = [value]
    return value


FAILURES: Mapping[str, Callable[[], Any]] = {
    "AttributeError": lambda: "text".child_frame_id,  # type: ignore[attr-defined]
    "IndexError": lambda: [][0],
    "KeyError": lambda: {}["internal"],
    "RecursionError": lambda: nested(100_000),
    "ZeroDivisionError": lambda: 1 / 0,
}


@pytest.mark.parametrize("kind", FAILURES)
def test_a_failing_view_reports_the_error_and_continues(
    serve: Callable[[ServedViews], Access], caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    calls = []

    async def view(_: Mapping[str, Any]) -> AsyncIterator[Any]:
        calls.append(1)
        if len(calls) <= 2:
            yield FAILURES[kind]()
        yield len(calls)

    async def action(_: Mapping[str, Any]) -> Any:
        return FAILURES[kind]()

    with browser_of(serve(ServedViews({"view": view}, {"fail": action}))) as browser:
        values = browser.watch("view")
        assert kind in next(values)["error"]
        assert next(values) == 3  # not the second failure, which was the same
        for _ in range(3):
            assert kind in browser.act("fail")["error"]
    assert [record.getMessage().split()[0] for record in caplog.records] == ["view", "fail"]


def test_a_missing_argument_is_named(serve: Callable[[ServedViews], Access]) -> None:
    async def action(arguments: Mapping[str, Any]) -> Any:
        return arguments["node"]

    with browser_of(serve(ServedViews({}, {"show": action}))) as browser:
        assert browser.act("show")["error"] == "missing argument 'node'"


def test_a_refused_view_is_not_tried_again(serve: Callable[[ServedViews], Access]) -> None:
    async def changing(_: Mapping[str, Any]) -> AsyncIterator[Any]:
        yield 1

    async def alive(_: Mapping[str, Any]) -> Any:
        return True

    served = ServedViews({"changing": changing}, {"alive": alive}, frozenset({"changing"}))
    with browser_of(serve(served)) as browser:
        assert "read-only" in next(browser.watch("changing"))["error"]
        assert browser.act("alive") is True


def test_the_views_of_a_busy_browser_do_not_keep_another_one_waiting(
    serve: Callable[[ServedViews], Access],
) -> None:
    steps = 0

    async def busy(_: Mapping[str, Any]) -> AsyncIterator[Any]:
        nonlocal steps
        while True:
            time.sleep(0.02)
            steps += 1
            await asyncio.sleep(0)
            yield steps

    async def count(_: Mapping[str, Any]) -> int:
        return steps

    access = serve(ServedViews({"busy": busy}, {"count": count}))
    with browser_of(access) as greedy, browser_of(access) as other:
        for number in range(1, 101):
            greedy.socket.send(json.dumps({"id": number, "view": "busy"}))
        greedy.socket.recv(timeout=30)
        counts = [other.act("count") for _ in range(6)]
    assert counts[-1] - counts[0] < 5 * 50  # without a share, each act waits for 100 steps and more


def test_the_arguments_of_open_views_are_limited(serve: Callable[[ServedViews], Access]) -> None:
    async def view(_: Mapping[str, Any]) -> AsyncIterator[Any]:
        yield 1
        await asyncio.Event().wait()

    with browser_of(serve(ServedViews({"view": view}))) as browser:

        def opened(number: int) -> Any:
            browser.socket.send(json.dumps({"id": number, "view": "view", "args": {"x": "x" * 900_000}}))
            while (answer := json.loads(browser.socket.recv(timeout=30)))["id"] != number:
                pass
            return answer

        browser.act("nothing")  # the answer shows that the server has admitted the browser
        assert [opened(number).get("data") for number in (1, 2)] == [1, 1]
        assert "more than 2000000 characters; close some of them" in opened(3)["error"]
        browser.socket.send(json.dumps({"id": 1, "stop": True}))
        wait_until(lambda: opened(3).get("data") == 1)


def test_infinite_numbers_do_not_stop_a_view(serve: Callable[[ServedViews], Access]) -> None:
    async def view(_: Mapping[str, Any]) -> AsyncIterator[Any]:
        yield {"rate": float("inf")}
        yield {"rate": float("nan")}
        yield {"rate": 1.5}

    with browser_of(serve(ServedViews({"view": view}))) as browser:
        values = browser.watch("view")
        assert [next(values)["rate"] for _ in range(3)] == [None, None, 1.5]


def test_another_origin_is_refused(serve: Callable[[ServedViews], Access]) -> None:
    access = serve(ServedViews())
    with (
        pytest.raises(InvalidStatus),
        connect(f"ws://localhost:{access.port}/live", origin=Origin("http://evil.example"), proxy=None),
    ):
        pass


def test_the_token_is_not_logged_at_any_level(serve: Callable[[ServedViews], Access], caplog) -> None:
    caplog.set_level(logging.INFO, logger="websockets.client")  # the test's own
    for name in ("", "pipros_server", "pipros_page", "asyncio"):
        caplog.set_level(logging.DEBUG, logger=name)
    access = serve(ServedViews())
    with browser_of(access) as browser:
        assert "unknown action" in browser.act("nothing")["error"]
    assert access.secret.token not in caplog.text


@pytest.mark.parametrize(("host", "other"), [("127.0.0.1", "::1"), ("::1", "127.0.0.1")])
def test_another_user_cannot_take_the_other_address_of_localhost(host: str, other: str) -> None:
    """Browsers open `localhost` at ::1 first, and the page of a stranger there could read the token."""
    try:
        sockets.listen(other).close()
    except OSError:
        pytest.skip(f"this machine does not have the address {other}")
    loop = BackgroundLoop("page")
    with ExitStack() as stack:
        loop.start()
        stack.callback(loop.stop)
        server = PageServer(ServedViews())
        loop.run(server.start(host, 0), 30)
        stack.callback(lambda: loop.run(server.close(), 30))
        with pytest.raises(OSError, match="in use"):
            sockets.listen(other, server.access.port)
        with socket.create_connection((other, server.access.port), 10) as browser:
            browser.sendall(f"GET / HTTP/1.1\r\nHost: localhost:{server.access.port}\r\n\r\n".encode())
            assert browser.recv(9) == b"HTTP/1.1 "


def test_a_page_does_not_open_beside_the_port_of_another_user() -> None:
    loop = BackgroundLoop("page")
    with ExitStack() as stack:
        try:
            stranger = stack.enter_context(sockets.listen("::1"))
        except OSError:
            pytest.skip("this machine does not have the address ::1")
        loop.start()
        stack.callback(loop.stop)
        with pytest.raises(OSError, match="in use"):
            loop.run(PageServer(ServedViews()).start("127.0.0.1", stranger.getsockname()[1]), 30)
