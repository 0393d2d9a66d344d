"""The state before `init_node`: names, clock, parameters, and operations that wait for the node."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Sequence

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.clock import Clock, WallClock
from pipros.node.endpoints import NameInUse
from pipros.node.identity import Identity
from pipros.node.params import Parameters

Deferred = Callable[[Node], object]


class BeforeInit:
    """The state of a process without a node.

    Attributes:
        clock: the process's clock.
        caller_id: the full name of the process, if a package set one.
    """

    def __init__(self) -> None:
        self.clock: Clock = WallClock()
        self._arguments: names.Arguments | None = None  # if set, used instead of the command line
        self._clients: tuple[str, MasterClient, Parameters] | None = None
        self._lock = threading.Lock()
        self.reset()

    def reset(self) -> None:
        """Discard deferred operations and resolved remappings before another node starts."""
        self.caller_id: str | None = None
        self._remappings: dict[str, str] | None = None
        self._deferred: list[Deferred] = []
        self._services: set[str] = set()

    # -- names ----------------------------------------------------------------------

    @property
    def has_resolved_remappings(self) -> bool:
        return self._remappings is not None

    def read_arguments(self, argv: Sequence[str]) -> None:
        """Use the remappings in `argv` instead of those on the command line."""
        self._arguments = names.parse_arguments(argv)

    def resolve_remappings_for(self, node_name: str) -> None:
        """Resolve the remappings relative to `node_name`, a full name."""
        self._remappings = names.resolve_remappings(self.identity_of(None).arguments.remappings, node_name)

    def identity_of(self, node: Node | None) -> Identity:
        """Return the identity of the node, or of the process if `node` is None.

        Remappings set by `read_arguments` or `resolve_remappings_for` replace those of the identity.
        """
        if node is not None:
            identity = node.identity
        else:
            identity = Identity.unnamed(argv=sys.argv, environment=Environment.from_os())
            if name := self.caller_id:
                identity = identity._replace(name=name, namespace=names.namespace(name))
        if self._arguments is not None:
            identity = identity._replace(arguments=self._arguments)
        return identity if self._remappings is None else identity._replace(remappings=self._remappings)

    # -- master -----------------------------------------------------------------------

    @property
    def master(self) -> MasterClient:
        return self._connected()[1]

    @property
    def params(self) -> Parameters:
        return self._connected()[2]

    def _connected(self) -> tuple[str, MasterClient, Parameters]:
        uri = Environment.from_os().master_uri
        if self._clients is None or self._clients[0] != uri:
            identity = self.identity_of(None)
            master = MasterClient(uri, identity.name)
            parameters = Parameters(master, lambda name: self.identity_of(None).resolve(name), lambda: None)
            self._clients = uri, master, parameters
        return self._clients

    # -- deferred operations --------------------------------------------------------------

    def defer(self, action: Deferred) -> None:
        """Defer an operation until the node has started."""
        self._deferred.append(action)

    def take_deferred(self) -> list[Deferred]:
        """Remove and return the deferred operations."""
        deferred, self._deferred = self._deferred, []
        return deferred

    def claim_service(self, name: str) -> None:
        """Reserve the name of a service.

        Raises:
            NameInUse: another service has the name.
        """
        with self._lock:
            if name in self._services:
                raise NameInUse(f"service [{name}] already registered")
            self._services.add(name)

    def release_service(self, name: str) -> None:
        """Undo `claim_service`. May be called repeatedly."""
        self._services.discard(name)
