"""The program that serves Foxglove clients."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from pipros.basics.errors import PiprosError
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros_bridges.foxglove.handler import SUBPROTOCOLS, FoxgloveHandler, Rules
from pipros_bridges.serve import BridgeOptions, secret_of, serve
from pipros_bridges.sessions import Handler
from pipros_server.act_gate import ActGate


class BadPattern(PiprosError):
    """A whitelist contains a malformed regular expression."""


class FoxgloveProtocol:
    """Both Foxglove subprotocols, for `pipros_bridges.serve.serve`."""

    page = None

    def __init__(self, handler: FoxgloveHandler) -> None:
        self._handler = handler

    def handlers(self) -> Mapping[str, Handler]:
        return dict.fromkeys(SUBPROTOCOLS, self._handler)

    def start(self) -> None:
        self._handler.start()

    def close(self) -> None:
        self._handler.close()


def serve_foxglove(node: Node, options: BridgeOptions, rules: Rules) -> int:
    """Serve Foxglove clients until Ctrl-C; see `pipros_bridges.serve.serve`."""

    def make(node: Node, loop: BackgroundLoop) -> FoxgloveProtocol:
        return FoxgloveProtocol(FoxgloveHandler(node, loop, rules, gate=ActGate(node, options.policy)))

    return serve(node, options, make, secret_of(options))


def compiled(patterns: Iterable[str]) -> Sequence[re.Pattern[str]]:
    """Compile the regular expressions of a whitelist.

    Raises:
        BadPattern: an expression is malformed.
    """
    found = []
    for pattern in patterns:
        try:
            found.append(re.compile(pattern))
        except re.error as error:
            raise BadPattern(f"[{pattern}] is not a regular expression: {error}") from None
    return found
