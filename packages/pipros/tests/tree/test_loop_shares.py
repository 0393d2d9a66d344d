"""Every server whose clients share an event loop gives each of them a `LoopShare`."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from tests.support.environments import ROOTS, files_below, import_path

OPENING = {
    "websockets.asyncio.server.serve", "websockets.sync.server.serve", "websockets.serve",
    "websockets.server.serve",
    "asyncio.start_server", "asyncio.start_unix_server", "create_server", "create_unix_server",
    "create_datagram_endpoint", "uvicorn.Config", "uvicorn.run",
    "http.server.HTTPServer", "http.server.ThreadingHTTPServer", "socketserver.TCPServer",
    "socketserver.ThreadingTCPServer", "socketserver.UDPServer", "wsgiref.simple_server.make_server",
    "xmlrpc.server.SimpleXMLRPCServer", "aiohttp.web.run_app", "tornado.httpserver.HTTPServer",
}  # fmt: skip
"""Functions and classes that open a server. What `loop.` precedes is a method of the event loop."""

WORDS = {name.rpartition(".")[2] for name in OPENING} - {"serve", "run"} | {"websockets", "uvicorn"}
"""What a module that opens a server contains."""
SHARES = {"pipros_server.loop_share.LoopShare", "pipros_server.loop_share.LoopShares"}
OTHERS = {
    "pipros/net/rpc_server.py": "peers of ROS: requests are small, and parsed in slices",
    "pipros_tools/testing/faults/tcp_proxy.py": "a proxy of one test",
    "pipros_tab/serve.py": "a thread for each connection, and only files",
}


def names_of(tree: ast.AST) -> dict[str, str]:
    """Return the full names of what a module imports, by the names that it uses."""
    found: dict[str, str] = {}
    for each in ast.walk(tree):
        if isinstance(each, ast.Import):
            found |= {alias.asname or alias.name: alias.name for alias in each.names}
        elif isinstance(each, ast.ImportFrom):
            found |= {alias.asname or alias.name: f"{each.module}.{alias.name}" for alias in each.names}
    return found


def used(tree: ast.AST) -> Iterator[str]:
    names = names_of(tree)
    for each in ast.walk(tree):
        if isinstance(each, ast.Name):
            yield names.get(each.id, "")
        elif isinstance(each, ast.Attribute):
            base = ast.unparse(each.value)
            yield f"{names.get(base, base)}.{each.attr}"
            yield each.attr


def servers(folder: Path) -> Iterator[tuple[str, bool]]:
    """Yield the modules that open servers, and whether they share the loop."""
    for file in files_below(folder, "*.py"):
        text = file.read_text(encoding="utf-8")
        if any(word in text for word in WORDS):
            tree = ast.parse(text)
            words = set(used(tree))
            if words & OPENING:
                yield import_path(file).as_posix(), bool(words & SHARES)


def test_every_server_shares_its_loop() -> None:
    found = dict(pair for folder in ROOTS for pair in servers(folder))

    assert found.pop("pipros_server/port.py"), "the port of the page, of rosbridge and of Foxglove"
    assert {name for name, shares in found.items() if not shares} == {*OTHERS}
    assert len(found) > len(OTHERS)


def test_servers_are_found_however_they_are_opened(tmp_path: Path) -> None:
    texts = {
        "a": "import asyncio\nasync def f(): await asyncio.start_server(None, None, 0)",
        "b": "from websockets.asyncio.server import serve as s\nasync def f(): await s(None)",
        "c": "import asyncio\nasync def f(): await asyncio.get_running_loop().create_server(None)",
        "d": "from http.server import HTTPServer\nclass A(HTTPServer): pass",
        "e": "import uvicorn\nfrom pipros_server.loop_share import LoopShare\nuvicorn.run(LoopShare)",
        "f": "class A:\n    def serve(self): self.serve()",
    }
    trees = {name: set(used(ast.parse(text))) for name, text in texts.items()}

    assert [name for name, words in trees.items() if words & OPENING] == ["a", "b", "c", "d", "e"]
    assert [name for name, words in trees.items() if words & SHARES] == ["e"]
