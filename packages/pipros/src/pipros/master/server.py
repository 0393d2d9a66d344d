"""`MasterServer`, which combines the parts of a master on an asyncio event loop."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits, process_limits
from pipros.basics.names import NAME_CHARACTERS
from pipros.basics.ports import AdvertisedAddress
from pipros.basics.printable import printable
from pipros.master import statistics
from pipros.master.api import MasterApi
from pipros.master.arguments import SUCCESS
from pipros.master.liveness import Liveness, find_live_nodes
from pipros.master.notifier import Notifier
from pipros.master.options import MasterOptions
from pipros.master.param_weight import SMALL, TooManyElements, weigh
from pipros.master.params import ParamTree
from pipros.master.registry import Notice, Registry
from pipros.master.store import Store, restore_params, restore_registrations
from pipros.net import address
from pipros.net.rpc_server import RpcServer, current_caller
from pipros.net.this_machine import ThisMachineCaller

_log = logging.getLogger("rosmaster.master")


class MasterServer:
    """A master that runs on the event loop in which `start()` is awaited.

    Only the constructor may be called outside that loop.
    """

    def __init__(
        self,
        options: MasterOptions,
        *,
        hosts: Sequence[str],
        advertised: AdvertisedAddress,
        admits: Callable[[ThisMachineCaller], bool] | None,
    ) -> None:
        """Create the parts of the master; `start` opens the port.

        Args:
            hosts: the addresses to listen on.
            advertised: the address at which nodes reach the port.
            admits: decides whether a caller may connect; by default, all callers may.
        """
        self._options = options
        self._advertised = advertised
        self._store: Store | None = None
        limits = options.limits or process_limits()
        self.registry = Registry()
        self.params = ParamTree(limit_bytes=limits.parameter_bytes)
        self.liveness = Liveness(self.registry, self._remove_node, options.probing)
        self.notifier = Notifier(RegisteredNodes(self.registry, self.liveness, limits), limits)
        self._api = MasterApi(
            self.registry,
            self.params,
            notify=self.notifier.notify,
            shutdown=self._shut_down,
        )
        methods: dict[str, Callable[..., Any]] = {
            **self._api.methods,
            "getParamNames": self._get_param_names,
            "setParam": partial(self._change_param, "setParam"),
            "deleteParam": partial(self._change_param, "deleteParam"),
            "lookupNode": self._look_up_node,
            statistics.METHOD: self._statistics,
        }
        self.rpc = RpcServer(
            methods,
            host=hosts,
            port=options.port,
            limits=limits,
            admits=admits,
            on_lost=self.liveness.note_lost,
        )
        self._rate = statistics.CallRate()
        self._started_at = 0.0

    @property
    def uri(self) -> str:
        return self._api.uri

    async def start(self) -> None:
        """Restore the store's contents, set the parameters, then open the port.

        Raises:
            OSError: the port is in use, or the address does not belong to this machine.
            StoreUntrusted: another user could have written to the store.
        """
        if self._options.store:
            self._store = await asyncio.to_thread(Store, self._options.store)
            await self._resume(self._store)
        for key, value in self._options.parameters.items():
            self.params.set(key, value)
        try:
            await self.rpc.start()
        except BaseException:
            await self.stop()
            raise
        self._api.uri = address.uri(*self._advertised.outside(self.rpc.port))
        _log.info("Master initialized: port[%d], uri[%s]", self.rpc.port, self._api.uri)
        self.liveness.own_port = self.rpc.port
        self.liveness.start()
        self._started_at = asyncio.get_running_loop().time()
        self._sample()

    async def stop(self) -> None:
        """Close the port and all connections, and write pending changes to the store."""
        self.liveness.stop()
        self.notifier.close()
        await self.rpc.stop()
        if self._store:
            await asyncio.to_thread(self._store.close)

    async def _resume(self, store: Store) -> None:
        stored = store.restored
        restore_params(self.params, stored)
        nodes = {found.node: found.api for found in stored.registrations}
        alive = await find_live_nodes(nodes, self._options.probing.resume_s)
        store.forget_registrations()
        self.registry.journal = store
        self.params.journal = store
        restore_registrations(self.registry, stored, set(alive))
        for node, has_responded in alive.items():
            if has_responded:
                self.liveness.note_reached(node)
        if stored.parameters or nodes:
            _log.info("resumed from %s: %d of %d nodes were kept", store.file, len(alive), len(nodes))

    def _remove_node(self, node: str, api: str) -> None:
        if self.registry.api_of(node) == api:
            self.notifier.notify(self.registry.remove_node(node))

    def _shut_down(self, reason: str) -> bool:
        if not self._options.on_shutdown or not current_caller.get().is_here:
            return False
        # Stop a moment later, after the response has been sent.
        asyncio.get_running_loop().call_later(0.05, self._options.on_shutdown, printable(reason))
        return True

    def _look_up_node(self, *params: object) -> Any:
        """Return the API of a node. A node that asks for its own is alive; see `Registrations.watch`."""
        answer = self._api.methods["lookupNode"](*params)
        if answer[0] == SUCCESS and params[0] == params[1]:
            self.liveness.note_asking(str(params[0]), answer[2], current_caller.get())
        return answer

    async def _get_param_names(self, *params: object) -> Any:
        """Return the names of all parameters.

        A thread traverses the tree, because this takes a long time if the tree is large. It is safe, because
        the tree's values are never changed.
        """
        answer = self._api.methods["getParamNames"]
        return await asyncio.get_running_loop().run_in_executor(self.rpc.large_values, answer, *params)

    def _change_param(self, method: str, *params: object) -> Any:
        """Set or delete a parameter. Return an awaitable if the new or the replaced value is large."""
        value, former = params[2] if len(params) > 2 else None, self._former(params)
        try:
            weights = {id(each): weigh(each, elements_limit=SMALL) for each in (value, former)}
        except TooManyElements:
            return self._change_large_param(method, params)
        with self.params.weights_known(weights):
            return self._api.methods[method](*params)

    async def _change_large_param(self, method: str, params: tuple[object, ...]) -> Any:
        """Set or delete a parameter after weighing the new and the replaced value in a thread.

        If another call sets the parameter in the meantime, the value that it set is also weighed.
        """
        loop = asyncio.get_running_loop()
        weighed: list[Any] = []  # keeps the values alive, so that each `id` stays unique
        weights: dict[int, int] = {}
        while waiting := [
            value for value in (*params[2:3], self._former(params)) if id(value) not in weights
        ]:
            for value in waiting:
                weights[id(value)] = await loop.run_in_executor(self.rpc.large_values, weigh, value)
            weighed += waiting
        with self.params.weights_known(weights):
            return self._api.methods[method](*params)

    def _former(self, params: tuple[Any, ...]) -> Any:
        """Return the value that a call would replace, or None if there is none or an argument is invalid."""
        if len(params) < 2 or type(params[0]) is not str or type(params[1]) is not str:
            return None
        if not params[1] or max(map(len, params[:2])) > NAME_CHARACTERS:
            return None
        return self.params.former(names.resolve(params[1], params[0]))

    def _sample(self) -> None:
        loop = asyncio.get_running_loop()
        self._rate.sample(loop.time(), sum(self.rpc.calls.values()))
        loop.call_later(1.0, self._sample)

    async def _statistics(self, _caller_id: str) -> list[Any]:
        loop = asyncio.get_running_loop()
        param_names = await loop.run_in_executor(self.rpc.large_values, self.params.names)
        figures = statistics.collect(
            uptime_s=loop.time() - self._started_at,
            registry=self.registry,
            param_count=len(param_names),
            rpc=self.rpc,
            notifier=self.notifier,
            liveness=self.liveness,
            rate=self._rate,
        )
        return [1, "statistics", figures]


class RegisteredNodes:
    """The `Recipients` of a master's `Notifier`.

    It decides whether notices are still due, and reports the outcome of deliveries to `Liveness`.
    """

    def __init__(self, registry: Registry, liveness: Liveness, limits: Limits | None = None) -> None:
        self._registry = registry
        self._liveness = liveness
        self._timeout_s = (limits or process_limits()).notice_s

    async def may_deliver(self, notice: Notice) -> bool:
        """Return whether a notice is still due, and the server at its URI is the node.

        A peer can register any address, so other servers get no notices (`pipros.net.identify`).
        """
        if notice.method == "shutdown":
            return await self.may_shut_down(notice)
        if not self.is_current(notice):
            return False
        if await self._liveness.is_node(notice.node, notice.api, self._timeout_s):
            return self.is_current(notice)
        _log.info("%s: the server at %s is not this node; nothing is sent there", notice.node, notice.api)
        return False

    def is_current(self, notice: Notice) -> bool:
        """Return whether the node still uses the notice's URI."""
        return self._registry.api_of(notice.node) == notice.api

    async def may_shut_down(self, notice: Notice) -> bool:
        """Return True if the address still belongs to the replaced process, which must then be shut down.

        See ros_comm#2241.
        """
        if await self._liveness.is_at(notice.node, notice.api):
            _log.info("%s: shutting down its former process at %s", notice.params[1], notice.api)
            return True
        _log.info(
            "%s: its former process is no longer at %s; nothing is shut down", notice.params[1], notice.api
        )
        return False

    def on_delivered(self, notice: Notice) -> None:
        self._liveness.note_reached(notice.node)

    def on_failed(self, notice: Notice, error: PiprosError) -> None:
        _log.info("%s could not be delivered to %s: %s", notice.method, notice.node, error)
        if self.is_current(notice):
            self._liveness.suspect(notice.node)

    def on_finished(self, notice: Notice) -> None:
        self._registry.notice_done(notice)
