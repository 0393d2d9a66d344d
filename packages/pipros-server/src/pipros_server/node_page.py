"""Serve a node's own page, on loopback only, as long as the node runs."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Iterator
from typing import Final

from pipros.net.loop import BackgroundLoop
from pipros_server.access import Access
from pipros_server.desktop import open_in_browser
from pipros_server.view_server import PageServer, ServedViews

_CLOSING_S: Final = 0.3


@contextlib.contextmanager
def served_page(served: ServedViews, node: str, log: logging.Logger) -> Iterator[None]:
    """Serve the page within the context, print its address on stderr, and open it if there is a desktop.

    `node` is the name of the node.
    """
    loop = BackgroundLoop(f"page of {node}")
    loop.start()
    server = PageServer(served)
    try:
        try:
            loop.run(server.start("127.0.0.1", 0))
        except OSError as error:
            log.warning("the page cannot be served: %s", error)
        else:
            # Printed on stderr, because roslaunch redirects nodes' standard output to files. Not logged,
            # because every node can read the log, and the address contains the token.
            print(f"{node.lstrip('/')}: {server.access.url('localhost')}", file=sys.stderr, flush=True)
            loop.run(_open(server.access))
        yield
    finally:
        with contextlib.suppress(TimeoutError):
            loop.run(server.close(), _CLOSING_S)
        loop.stop(_CLOSING_S)


async def _open(access: Access) -> None:
    open_in_browser(access, "localhost")
