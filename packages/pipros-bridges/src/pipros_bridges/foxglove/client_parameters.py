"""The parameters that one Foxglove client reads, sets and watches."""

from __future__ import annotations

import functools
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any, Final

from pipros.basics.errors import InvalidName, LimitExceeded, NotFound, PiprosError
from pipros.basics.limits import limit_text
from pipros.basics.names import is_legal
from pipros.basics.printable import printable
from pipros_bridges.client import BridgeClient
from pipros_bridges.foxglove import frames
from pipros_bridges.foxglove.bridge_state import READ_ONLY, FoxgloveBridge, check_limit
from pipros_bridges.foxglove.parameter_watch import DELETED, Changes
from pipros_bridges.foxglove.parameters import from_client, selected, to_client
from pipros_bridges.foxglove.requests import SetParameters
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import WebSocketFrame
from pipros_tools.graph.params import refused

PARAMETER_NAME_BYTES: Final = 200
"""Approximate memory for the name of a parameter, besides its characters."""


class ClientParameters:
    """The parameters of one client. For use in the event loop."""

    def __init__(
        self,
        client: BridgeClient,
        bridge: FoxgloveBridge,
        run: Callable[[Callable[[], Any]], Awaitable[Any]],
        report: Callable[[str], None],
    ) -> None:
        """Store the arguments. `run` calls a function in a thread; `report` sends the client an error."""
        self._client = client
        self._bridge = bridge
        self._run = run
        self._report = report
        self._names: set[str] = set()  # the subscribed parameters
        self._takes_all = False

    @property
    def is_subscribed(self) -> bool:
        """Whether the client subscribes to parameters."""
        return self._takes_all or bool(self._names)

    def show(self, changes: Changes) -> None:
        """Send the changed parameters to which the client subscribes."""
        rows = [
            {"name": name} if value is DELETED else to_client(name, value)
            for name, value in changes.items()
            if self._takes_all or name in self._names
        ]
        if rows:
            self._client.send(frames.parameter_values(rows))

    async def send(self, names: Sequence[str], request: str | None) -> None:
        async def make() -> WebSocketFrame:
            frame: WebSocketFrame = await self._run(functools.partial(self._values, names, request))
            return frame

        await self._client.send_large(make)

    def _values(self, names: Sequence[str], request: str | None) -> WebSocketFrame:
        """Return the answer to a request for parameters. Blocks.

        Raises:
            LimitExceeded: the answer does not fit into the client's queue.
        """
        resolved = list(map(self._bridge.node.resolve, names))
        found = self._bridge.parameters(resolved)
        wanted = selected(found, resolved) if names else found
        frame = frames.parameter_values([to_client(*pair) for pair in wanted.items()], request)
        limit = self._bridge.node.limits.of(BridgeLimits).bridge_queue_bytes
        if frame.size > limit:
            raise LimitExceeded(
                f"the parameters take {frame.size} bytes; {limit_text('bridge_queue_bytes', limit)}; "
                "request some of them by name"
            )
        return frame

    async def set(self, request: SetParameters) -> None:
        if not self._bridge.has_control:
            raise PiprosError(READ_ONLY)
        for parameter in request.parameters:
            try:
                await self._run(functools.partial(self._set_one, parameter))
            except (PiprosError, ValueError, TypeError, OverflowError) as error:
                self._report(f"parameter [{printable(parameter['name'])}]: {error}")
        if request.id is not None:
            await self.send([each["name"] for each in request.parameters], request.id)

    def _set_one(self, parameter: Mapping[str, Any]) -> None:
        """Set or delete a parameter. Blocks."""
        name, node = parameter["name"], self._bridge.node
        key, allow = node.resolve(name), self._bridge.allows_parameter
        if not allow(key):
            raise PiprosError("the whitelist does not allow it")
        value = None if parameter.get("value") is None else from_client(parameter)
        if (other := refused(key, value, node.master.get_param_names(), allow)) is not None:
            raise PiprosError(f"the whitelist does not allow the parameter {printable(other)}")
        if value is not None:
            self._bridge.gate.check_parameter(node.resolve(name), value)
            node.params.set(name, value)
            return
        self._bridge.gate.check_other("delete parameters")
        try:
            node.params.delete(name)
        except NotFound:
            return

    def subscribe(self, names: Sequence[str]) -> None:
        for name in names:
            if not is_legal(name):
                raise InvalidName(f"[{printable(name)}] is not a legal parameter name")
        new = set(map(self._bridge.node.resolve, names)) - self._names
        if new:
            check_limit(len(self._names) + len(new) - 1)
        self._client.shares.keep(sum(map(_size_of, new)))
        self._takes_all |= not names
        self._names |= new
        self._bridge.watch_parameters()

    def unsubscribe(self, names: Sequence[str]) -> None:
        self._takes_all &= bool(names)
        gone = self._names & set(map(self._bridge.node.resolve, names))
        self._names -= gone
        self._client.shares.release(sum(map(_size_of, gone)))
        self._bridge.watch_parameters()


def _size_of(name: str) -> int:
    return len(name) + PARAMETER_NAME_BYTES
