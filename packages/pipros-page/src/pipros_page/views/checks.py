"""Find out why no data arrives on a topic, for the button "Why no data?" of several tabs."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from pipros.basics.errors import PiprosError
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.daemon_pool import DaemonPool
from pipros_server.view_server import RequestRefused
from pipros_tools.health.gather_topic import gather_topic
from pipros_tools.health.topic_check import check_topic
from pipros_tools.health.topic_facts import TopicCheck

AT_ONCE = 2
"""Maximum number of concurrent checks by all browsers; each runs a node for a few seconds."""
MAX_WAITING = 8
"""Maximum number of checks that run or wait."""
WAIT_S = 3.0
"""How long messages are received for a check."""


class CheckViews:
    """The action behind the button. It checks the running system, even while the browser shows a bag."""

    def __init__(self, system: WatchedSystem) -> None:
        self._environment = system.node.environment
        self._pool = DaemonPool("topic check", AT_ONCE)
        self._running: dict[str, asyncio.Future[TopicCheck]] = {}

    async def why_no_data(self, arguments: Mapping[str, object]) -> Any:
        """Return the steps up to the first that fails, as `pipros doctor TOPIC --json` prints them.

        A check takes `WAIT_S`, and a few seconds more if nodes do not answer. Browsers that request the same
        topic meanwhile share the check.

        Raises:
            RequestRefused: too many checks are running, or the check fails, for example because the master
                does not answer.
        """
        name = topic_name(arguments)
        check = self._running.get(name)
        if check is None:
            if len(self._running) >= MAX_WAITING:
                raise RequestRefused(f"{MAX_WAITING} topics are being checked; try again in a few seconds")
            check = self._running[name] = asyncio.ensure_future(self._pool.run(self._check, name))
            check.add_done_callback(lambda _: self._running.pop(name))
        try:
            return (await asyncio.shield(check)).as_json()
        except PiprosError as error:
            raise RequestRefused(f"{name} cannot be checked: {error}") from error

    def _check(self, name: str) -> TopicCheck:
        return check_topic(gather_topic(name, self._environment, wait_s=WAIT_S))
