"""For any names listed by a master, tools print a clean line each, and completion offers only legal names.

An input is names, separated by NUL: topics, nodes, types, URIs and services in turn.

python -m tests.fuzz.listings --seconds 60
"""

import contextlib
import io
import os
import re
import sys
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from unittest import mock

from pipros.basics.printable import printable
from pipros.wire.xmlrpc import decode_call, encode_response
from pipros_tools.cli import complete, rosnode, rosparam, rosservice, rostopic
from tests.fuzz import mutation

WORDS = [
    *(
        b"\0", b"/", b"/a", b"\n", b"\r", b"\t", b"\x1b[31m", b"\x7f", b"\x08", b" ", b"  ", b"$(true)", b"`",
        b"'", b";",
    ),
    *(
        text.encode()
        for text in ("\u009b", "\u2028", "\u202e", "\u200b", "\ufeff", "ü", "\U0001f600", "\u0301")
    ),
    *(
        b"http://a:1/", b"http://[::1]:1/", b"http://", b"rosrpc://a:1", b"std_msgs/String", b"[", b"]",
        b"%s", b"~", b"//",
    ),
]  # fmt: skip
NUL_SEPARATED = 5
LEGAL_NAME = re.compile(r"[A-Za-z0-9_/~]*")
UNCARRIED = re.compile("[^\\t\\n\\r\\x20-\\ud7ff\\ue000-\\ufffd\\U00010000-\\U0010ffff]")
"""What XML cannot carry at all."""


class LyingMaster:
    """Answers the calls of tools with the current names."""

    def __init__(self) -> None:
        self.names: list[list[str]] = [[] for _ in range(NUL_SEPARATED)]
        outer = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"
            disable_nagle_algorithm = True

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                answer = encode_response([1, "", outer.answer(decode_call(body)[0])])
                self.send_response(200)
                self.send_header("Content-Type", "text/xml")
                self.send_header("Content-Length", str(len(answer)))
                self.end_headers()
                self.wfile.write(answer)

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def answer(self, method: str) -> Any:
        topics, nodes, types, uris, services = self.names
        state = [[topic, nodes[at : at + 2]] for at, topic in enumerate(topics)]
        answers: dict[str, Any] = {
            "getSystemState": [state, state, [[service, nodes[:1]] for service in services if nodes]],
            "getTopicTypes": [[topic, kind] for topic, kind in zip(topics, types, strict=False)],
            "getPublishedTopics": [[topic, kind] for topic, kind in zip(topics, types, strict=False)],
            "getParamNames": topics,
            "lookupNode": uris[0] if uris else "",
            "lookupService": uris[0] if uris else "",
        }
        return answers[method]

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


class Listings:
    """The target; `close` ends its master."""

    def __init__(self) -> None:
        self._master = LyingMaster()

    def __call__(self, data: bytes) -> None:
        texts = [UNCARRIED.sub("?", text) for text in data.decode("utf-8", "replace").split("\0")]
        self._master.names = names = [texts[start::NUL_SEPARATED] for start in range(NUL_SEPARATED)]
        topics, nodes, _, _, services = (len(set(kind)) for kind in names)
        assert printable("".join(texts)).isprintable()
        with mock.patch.dict(os.environ, ROS_MASTER_URI=self._master.uri):
            self._check_lines(rosnode.main, ["list"], nodes)
            self._check_lines(rosnode.main, ["list", "-a"], nodes)
            self._check_lines(rosnode.main, ["list", "-u"], nodes)
            self._check_lines(rostopic.main, ["list"], topics)
            self._check_lines(rostopic.main, ["list", "-v"], 2 * topics + 6)
            self._check_lines(rostopic.main, ["list", "--host"], topics + 1)
            self._check_lines(rosservice.main, ["list", "-n"], services)
            self._check_lines(rosparam.main, ["list"], len(names[0]))
            for tool, subcommand in (("rosnode", "info"), ("rostopic", "echo"), ("rosservice", "type")):
                for offered in self._output(complete.main, ["2", tool, subcommand]):
                    assert LEGAL_NAME.fullmatch(offered), f"{tool}: {offered!r}"

    def _check_lines(self, main: Callable[[list[str]], int], arguments: list[str], limit: int) -> None:
        lines = self._output(main, arguments)
        for line in lines:
            assert line.replace("\t", "").isprintable(), f"{arguments}: {line!r}"
        assert len(lines) <= max(limit, 1), f"{arguments}: {len(lines)} lines for {limit} names"

    @staticmethod
    def _output(main: Callable[[list[str]], int], arguments: list[str]) -> list[str]:
        printed, complained = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(complained):
            code = main(arguments)
        assert code in (0, 1), f"{arguments}: {code}"
        for line in complained.getvalue().split("\n"):
            assert line.replace("\t", "").isprintable(), f"{arguments}: {line!r}"
        return printed.getvalue().removesuffix("\n").split("\n")

    def close(self) -> None:
        self._master.close()


if __name__ == "__main__":
    sys.exit(mutation.main(Listings(), "listings", WORDS))
