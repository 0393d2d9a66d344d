"""The parts of a master put together on one asyncio loop."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

from pipros.errors import PiprosError
from pipros.master import statistics
from pipros.master.api import MasterApi
from pipros.master.liveness import Liveness, who_answers
from pipros.master.notifier import Notifier
from pipros.master.params import ParamTree
from pipros.master.registry import Notice, Registry
from pipros.master.store import Store, restore_params, restore_registrations
from pipros.net import address
from pipros.net.rpc_server import RpcLimits, RpcServer, caller_address

_log = logging.getLogger("rosmaster.master")

_LOOKUPS_AT_A_TIME: Final = 64
"""Threads that look up host names, made as they are needed: some names take half a minute to be unknown."""

RESUME_ANSWER_S: Final = 1.0
"""How long the nodes of a crashed master have to say that they are still there."""


class MasterServer:
    """A master on the loop that `start()` is awaited on. Everything but making it happens there."""

    def __init__(
        self,
        *,
        hosts: Sequence[str],
        port: int,
        advertised_host: str,
        admits: Callable[[str], bool] | None,
        parameters: Mapping[str, Any],
        limits: RpcLimits | None,
        notice_timeout_s: float | None,
        store: Path | None,
        on_shutdown: Callable[[str], None] | None,
    ) -> None:
        """The arguments are those of `Master`."""
        self._advertised_host = advertised_host
        self._parameters = parameters
        self._store_file = store
        self._store: Store | None = None
        self._on_shutdown = on_shutdown
        self.registry = Registry()
        self.params = ParamTree()
        self.liveness = Liveness(self.registry, self._node_gone)
        self.notifier = Notifier(
            is_current=lambda notice: self.registry.api_of(notice.node) == notice.api,
            may_shut_down=self._may_shut_down,
            reached=lambda notice: self.liveness.note_reached(notice.node),
            failed=self._notice_failed,
            done=self.registry.dealt_with,
            timeout_s=notice_timeout_s,
        )
        self._api = MasterApi(
            self.registry, self.params, notify=self.notifier.notify, shutdown=self._shutdown_asked
        )
        methods: dict[str, Callable[..., Any]] = {
            **self._api.methods,
            "getParamNames": self._get_param_names,
            statistics.METHOD: self._statistics,
        }
        self.rpc = RpcServer(methods, host=hosts, port=port, limits=limits, admits=admits)
        self._rate = statistics.CallRate()
        self._lookups = ThreadPoolExecutor(_LOOKUPS_AT_A_TIME, thread_name_prefix="master")
        self._started_at = 0.0

    @property
    def uri(self) -> str:
        return self._api.uri

    async def start(self) -> None:
        """Restores what was kept, then opens the port.

        Raises:
            OSError: the port is taken, or the address is not of this machine, or the store cannot be made.
        """
        asyncio.get_running_loop().set_default_executor(self._lookups)
        if self._store_file:
            self._store = await asyncio.to_thread(Store, self._store_file)
            await self._resume(self._store)
        for key, value in self._parameters.items():
            self.params.set(key, value)
        try:
            await self.rpc.start()
        except BaseException:
            await self.stop()
            raise
        self._api.uri = address.uri(self._advertised_host, self.rpc.port)
        _log.info("Master initialized: port[%d], uri[%s]", self.rpc.port, self._api.uri)
        self.liveness.start()
        self._started_at = asyncio.get_running_loop().time()
        self._sample()

    async def stop(self) -> None:
        """Closes the port and all connections, and writes what is left to write."""
        self.liveness.stop()
        self.notifier.close()
        await self.rpc.stop()
        if self._store:
            await asyncio.to_thread(self._store.close)
        self._lookups.shutdown(wait=False, cancel_futures=True)

    async def _resume(self, store: Store) -> None:
        kept = store.kept
        restore_params(self.params, kept)
        nodes = {found.node: found.api for found in kept.registrations}
        answering = await who_answers(nodes, RESUME_ANSWER_S)
        store.forget_registrations()
        self.registry.journal = store
        self.params.journal = store
        restore_registrations(self.registry, kept, answering)
        for node in answering:
            self.liveness.note_reached(node)
        if kept.parameters or nodes:
            _log.info(
                "resumed from %s: %d of %d nodes are still there", store.file, len(answering), len(nodes)
            )

    def _node_gone(self, node: str, api: str) -> None:
        if self.registry.api_of(node) == api:
            self.notifier.notify(self.registry.remove_node(node))

    async def _may_shut_down(self, notice: Notice) -> bool:
        if await self.liveness.is_at(notice.node, notice.api):
            _log.info("%s: shutting down its former process at %s", notice.params[1], notice.api)
            return True
        _log.info("%s: %s is not that node any more, it is left alone", notice.params[1], notice.api)
        return False

    def _notice_failed(self, notice: Notice, error: PiprosError) -> None:
        _log.info("%s could not be delivered to %s: %s", notice.method, notice.node, error)
        if self.registry.api_of(notice.node) == notice.api:
            self.liveness.suspect(notice.node)

    def _shutdown_asked(self, reason: str) -> bool:
        if not address.is_loopback(caller_address.get()) or not self._on_shutdown:
            return False
        # Shortly after the answer is out.
        asyncio.get_running_loop().call_later(0.05, self._on_shutdown, reason)
        return True

    async def _get_param_names(self, *params: Any) -> Any:
        """In a thread: the walk through a large tree takes long, and what it walks is never changed."""
        answer = self._api.methods["getParamNames"]
        return await asyncio.get_running_loop().run_in_executor(self.rpc.large_values, answer, *params)

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
