"""The program that serves the page, rosbridge and Foxglove on one port."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pipros.basics.errors import PiprosError
from pipros.basics.plugins import offered
from pipros.net.loop import BackgroundLoop
from pipros.net.workers import Workers
from pipros.node import Node
from pipros_bridges.foxglove.handler import SUBPROTOCOLS, FoxgloveHandler, Rules
from pipros_bridges.rosapi import RosApi
from pipros_bridges.rosbridge.server import RosbridgeHandler
from pipros_bridges.rosbridge.session import RosbridgeNode
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.serve import BridgeOptions, secret_of, serve
from pipros_bridges.sessions import Handler
from pipros_server.act_gate import ActGate
from pipros_server.policy.model import Policy
from pipros_server.secret import Secret
from pipros_server.view_server import PageServer
from pipros_tools.graph.services import type_of

ROSAPI = "rosapi"


class AllProtocols:
    """The protocols of `pipros serve`, for `pipros_bridges.serve.serve`."""

    def __init__(
        self,
        node: Node,
        loop: BackgroundLoop,
        tool: str,
        secret: Secret | None,
        *,
        has_control: bool,
        policy: Policy | None,
    ) -> None:
        """Create the protocols, and the page if it is installed. If `secret` is None, the page creates one.

        All protocols share one gate, which enforces the policy.
        """
        gate = ActGate(node, policy)
        self._node = node
        self._loop = loop
        mounted = offered("page")
        self._page = None if mounted is None else mounted(node, tool, secret, gate, has_control=has_control)
        self._workers = Workers("timers of a bridge")
        self._rosapi: Node | None = None
        self.page: PageServer | None = None if self._page is None else self._page.server
        self._foxglove = FoxgloveHandler(node, loop, Rules(has_control=has_control), gate=gate)
        self._bridge = RosbridgeNode(
            node, self._call_later, RosbridgeSettings(has_control=has_control), gate=gate
        )

    def handlers(self) -> Mapping[str, Handler]:
        return {**dict.fromkeys(SUBPROTOCOLS, self._foxglove), "": RosbridgeHandler(self._bridge)}

    def start(self) -> None:
        if self._page is not None:
            self._page.start()
        self._foxglove.start()
        self._workers.run(self._serve_rosapi)

    def close(self) -> None:
        self._foxglove.close()
        self._bridge.close()
        if self._page is not None:
            self._page.close()
        self._workers.close()
        if self._rosapi is not None:
            self._rosapi.shutdown()

    def _serve_rosapi(self) -> None:
        """Offer rosapi's services, which rosbridge clients need, unless another node offers them. Blocks."""
        try:
            if type_of(self._node.master, f"/{ROSAPI}/topics") is not None:
                return
        except PiprosError:  # the other node has stopped responding, or the master is not available
            pass
        self._rosapi = Node(ROSAPI, environment=self._node.environment)
        self._rosapi.start()
        RosApi(self._rosapi).serve()

    def _call_later(self, delay_s: float, function: Callable[[], object]) -> None:
        self._loop.call(self._schedule, delay_s, function)

    def _schedule(self, delay_s: float, function: Callable[[], object]) -> None:
        self._loop.asyncio.call_later(delay_s, self._workers.run, function)


def serve_all(node: Node, options: BridgeOptions) -> int:
    """Serve the page, rosbridge and Foxglove until Ctrl-C; see `pipros_bridges.serve.serve`.

    On a network, all clients need a token: one from the token file if there is one, otherwise the page's
    token.
    """
    secret = secret_of(options)
    if secret is None and not options.is_local:
        secret = Secret()

    def make(node: Node, loop: BackgroundLoop) -> AllProtocols:
        return AllProtocols(
            node,
            loop,
            options.tool.replace(" ", "_"),
            secret,
            has_control=options.has_control,
            policy=options.policy,
        )

    return serve(node, options, make, secret)
