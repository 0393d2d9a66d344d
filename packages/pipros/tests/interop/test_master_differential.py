"""The same calls to genuine rosmaster and to ours: the same codes, texts, values and notifications."""

import threading
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager
from socketserver import ThreadingMixIn
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from pipros.master.master import Master
from tests.interop.master_script import calls, random_calls
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


class _Server(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True


class Slave:
    """The API of a node that only records its calls."""

    def __init__(self, letter: str) -> None:
        self.placeholder = f"<{letter}>"
        self.told: list[Any] = []
        self._server = _Server(("127.0.0.1", 0), logRequests=False)
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}/"
        for method in ("publisherUpdate", "paramUpdate", "shutdown"):
            self._server.register_function(self._note_as(method), method)
        self._server.register_function(lambda _: [1, "", 4711], "getPid")
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    def _note_as(self, method: str) -> Any:
        def note(*params: Any) -> list[Any]:
            self.told.append([method, *params])
            return [1, "", 0]

        return note

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


class Side:
    """A master and its nodes."""

    def __init__(self, uri: str) -> None:
        self.uri = uri
        self.proxy = xmlrpc.client.ServerProxy(uri)
        self.slaves = [Slave(letter) for letter in "ABC"]

    def close(self) -> None:
        self.proxy("close")()
        for slave in self.slaves:
            slave.close()

    def call(self, method: str, params: tuple[Any, ...]) -> Any:
        try:
            answer = self.proxy.__getattr__(method)(*self._real(params))
        except xmlrpc.client.Fault as fault:
            return ("fault", fault.faultCode, fault.faultString)
        return self._comparable(answer)

    def told(self) -> list[Any]:
        return [self._comparable(slave.told) for slave in self.slaves]

    def _real(self, value: Any) -> Any:
        if isinstance(value, (tuple, list)):
            return [self._real(item) for item in value]
        for slave in self.slaves:
            if value == slave.placeholder:
                return slave.uri
        return value

    def _comparable(self, value: Any) -> Any:
        if isinstance(value, list):
            return [self._comparable(item) for item in value]
        if isinstance(value, dict):
            return {key: self._comparable(item) for key, item in value.items()}
        if isinstance(value, xmlrpc.client.Binary):
            return ("binary", value.data)
        if isinstance(value, str):
            for slave in self.slaves:
                value = value.replace(slave.uri, slave.placeholder)
            return value.replace(self.uri, "<master>")
        return (type(value).__name__, str(value))


@contextmanager
def genuine(ros: RosSystem) -> Iterator[Side]:
    process = ros.genuine.start("rosmaster", "--core", "-p", str(ros.port))
    side = Side(ros.master_uri.rstrip("/") + "/")
    try:
        wait_until(lambda: _answers(side), 60, what="genuine rosmaster to answer")
        yield side
    finally:
        side.close()
        process.press_ctrl_c()
        process.wait()


def _answers(side: Side) -> bool:
    try:
        side.proxy.getPid("/test")
    except OSError:
        return False
    return True


def test_hundreds_of_calls_have_the_responses_and_notifications_of_genuine_rosmaster(ros: RosSystem) -> None:
    with genuine(ros) as theirs, Master(port=0) as master:
        ours = Side(master.uri)
        try:
            differences = []
            script = list(calls())
            for method, params in script:
                expected, got = theirs.call(method, params), ours.call(method, params)
                if got != expected and (method, len(params)) != ("getPid", 1):
                    differences.append(f"{method}{params}\n  genuine: {expected}\n  ours:    {got}")
                wait_until(lambda: _has_told_all(ours), 60, what="our notices to be delivered")
                wait_until(lambda: ours.told() == theirs.told(), 60, what=lambda: _told(theirs, ours))
            assert not differences, f"{len(differences)} of {len(script)}:\n" + "\n".join(differences)
            assert len(script) > 500
        finally:
            ours.close()


@pytest.mark.parametrize("seed", range(3))
def test_random_calls_are_answered_as_by_genuine_rosmaster(ros: RosSystem, seed: int) -> None:
    with genuine(ros) as theirs, Master(port=0) as master:
        ours = Side(master.uri)
        try:
            # Until the first service exists, genuine rosmaster has another text for unknown services.
            first = ("registerService", ("/z", "/z", "rosrpc://z:1", "http://127.0.0.1:99/"))
            for method, params in [first, *random_calls(1500, seed)]:
                expected, got = theirs.call(method, params), ours.call(method, params)
                if "is not iterable" not in str(expected):  # for which it raises
                    assert got == expected, (method, params)
        finally:
            ours.close()


def _has_told_all(side: Side) -> bool:
    figures: Any = side.proxy.pipros.getStatistics("/test")
    return figures[2]["notices_waiting"] == 0


def _told(theirs: Side, ours: Side) -> str:
    return f"the same notices: genuine {_latest(theirs)}, ours {_latest(ours)}"


def _latest(side: Side) -> list[Any]:
    return [told[-3:] for told in side.told()]
