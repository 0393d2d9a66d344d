"""Connect the notifier to the registered nodes."""

from __future__ import annotations

import logging

from pipros.basics.errors import PiprosError
from pipros.master.liveness import Liveness
from pipros.master.registry import Notice, Registry

_log = logging.getLogger("rosmaster.master")


class RegisteredNodes:
    """The `Recipients` of a master's `Notifier`.

    It decides whether notices are still due, and reports the outcome of deliveries to `Liveness`.
    """

    def __init__(self, registry: Registry, liveness: Liveness) -> None:
        self._registry = registry
        self._liveness = liveness

    def is_current(self, notice: Notice) -> bool:
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
