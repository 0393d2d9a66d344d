"""Fleets in the test's process: a router, and members with their masters."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.limits import process_limits
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_fleet.agent import Agent, agent_node_name
from pipros_fleet.fleet_file import parse_fleet_file
from pipros_fleet.fleet_rules import FleetFile
from pipros_fleet.limits import FleetLimits
from pipros_fleet.zenoh_connecting import connect, open_router
from pipros_fleet.zenoh_session import LinkFailed, SessionLink, Tls
from pipros_tools.graph.system_state import SystemState
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
POLL_S = 0.05
LIMIT_S = 60


def link_to(router: str, tls: Tls | None = None, **options: Any) -> SessionLink:
    """Connect to a router, with repeated attempts, as `pipros fleet join` makes them."""

    def connected() -> SessionLink | None:
        try:
            return connect(router, tls, **options)
        except LinkFailed as error:
            reasons.append(str(error))
            return None

    reasons: list[str] = []
    link = wait_until(connected, LIMIT_S, lambda: reasons[-1])
    assert link is not None
    return link


class _Kept(logging.Handler):
    """Handler that keeps the logged texts."""

    def __init__(self, texts: list[str]) -> None:
        super().__init__(logging.WARNING)
        self._texts = texts

    def emit(self, record: logging.LogRecord) -> None:
        self._texts.append(record.getMessage())


class Member:
    """A member with its own master.

    Attributes:
        name: the member's name in the fleet.
        failures: the errors that its agent passed to `on_failure`.
        warnings: the warnings and errors that its agent logged.
    """

    def __init__(
        self,
        name: str,
        router: str,
        file: str | FleetFile = "",
        *,
        master_uri: str | None = None,
        tls: Tls | None = None,
        limits: dict[str, Any] | None = None,
    ) -> None:
        self.name = name
        self._stack = ExitStack()
        self.failures: list[Exception] = []
        self.warnings: list[str] = []
        if master_uri is None:
            master_uri = self._stack.enter_context(Master(port=0)).uri
        self.environment = Environment(master_uri=master_uri)
        self.agent_node = Node(
            agent_node_name(name),
            environment=self.environment,
            limits=process_limits().with_table(FleetLimits(**(limits or {}))),
        )
        self._stack.enter_context(self.agent_node)
        self.agent_node.log.addHandler(_Kept(self.warnings))
        parsed = parse_fleet_file(file) if isinstance(file, str) else file
        self.link: SessionLink = link_to(router, tls, asker=name, limits=self.agent_node.limits)
        self._stack.callback(self.link.close)
        self.agent = Agent(
            self.agent_node, self.link, name, parsed, on_failure=self.failures.append, poll_s=POLL_S
        )
        self._stack.callback(self.agent.close)
        try:
            self.agent.start()
        except BaseException:
            self.close()
            raise

    def node(self, name: str) -> Node:
        """Start a node on the member's master, and return it."""
        return self._stack.enter_context(Node(name, environment=self.environment))

    def state(self) -> SystemState:
        return SystemState.from_state(self.agent_node.master.get_system_state())

    def wait_for_topic(self, topic: str) -> None:
        wait_until(lambda: topic in self.state().publishers, LIMIT_S, f"{topic} at {self.name}")

    def wait_for_input(self, topic: str) -> None:
        wait_until(
            lambda: topic in self.state().subscribers, LIMIT_S, f"a subscriber of {topic} at {self.name}"
        )

    def wait_for_service(self, service: str) -> None:
        wait_until(lambda: service in self.state().services, LIMIT_S, f"{service} at {self.name}")

    def receive(self, topic: str, kind: Any = String, name: str = "listener") -> list[Any]:
        """Subscribe to a topic, and return a list to which received messages are added."""
        found: list[Any] = []
        self.node(name).subscribe(topic, kind, found.append)
        return found

    def close(self) -> None:
        self._stack.close()

    def __enter__(self) -> Member:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def running_router(port: int, **options: Any) -> Iterator[str]:
    """Run a router, and yield its address."""
    address = f"tcp/127.0.0.1:{port}"
    router = open_router([address], **options)
    try:
        yield address
    finally:
        router.close()
