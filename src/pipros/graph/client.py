"""The connection of a tool to a running system: environment, master client, resolution of names."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from pipros.basics import names
from pipros.basics.graph_variables import master_uri_of, namespace_of, split_master_uri

if TYPE_CHECKING:
    from pipros.basics.env import Environment
    from pipros.net.master_client import MasterClient


class GraphClient:
    """The environment, the master client and the name resolution of a tool.

    A context manager that closes the connections to the master.
    """

    def __init__(
        self, tool: str, environment: Environment | None = None, *, timeout_s: float | None = None
    ) -> None:
        """Nothing is connected yet.

        Args:
            tool: the name below which private names are resolved: `rostopic`.
            timeout_s: how long one call of the master may take; None is without limit.
        """
        self._environment = environment
        self.master_uri = environment.master_uri if environment else master_uri_of(os.environ)
        namespace = environment.namespace if environment else namespace_of(os.environ)
        self.caller_id = f"/{tool}"
        self._node_name = names.join(namespace, tool)
        self._master: MasterClient | None = None
        self._timeout_s = timeout_s

    @property
    def environment(self) -> Environment:
        """All `ROS_*` variables; only few tools need them."""
        if self._environment is None:
            from pipros.basics.env import Environment

            self._environment = Environment.from_os()
        return self._environment

    def resolve(self, name: str) -> str:
        """The global name of an argument."""
        return names.resolve(name, self._node_name)

    @property
    def master(self) -> MasterClient:
        """A client of the master. Nothing is connected until its first call.

        Raises:
            InvalidEnvironment: ROS_MASTER_URI is malformed.
        """
        if self._master is None:
            from pipros.net.master_client import MasterClient

            split_master_uri(self.master_uri)
            self._master = MasterClient(self.master_uri, self.caller_id, timeout_s=self._timeout_s)
        return self._master

    def __enter__(self) -> GraphClient:
        return self

    def __exit__(self, *_: object) -> None:
        if self._master is not None:
            self._master.close()
