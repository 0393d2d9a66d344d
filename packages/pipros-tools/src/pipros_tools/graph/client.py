"""A tool's access to a running system: environment, master client and name resolution."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from pipros.basics import names
from pipros.basics.graph_variables import master_uri_of, namespace_of, split_master_uri

if TYPE_CHECKING:
    from pipros.basics.env import Environment
    from pipros.net.master_client import MasterClient


class GraphClient:
    """Environment, master client and name resolution of a tool.

    As a context manager, it closes the connections to the master on exit.
    """

    def __init__(
        self, tool: str, environment: Environment | None = None, *, timeout_s: float | None = None
    ) -> None:
        """Store the settings. The master client connects on its first call.

        Args:
            tool: the tool's name, such as `rostopic`, under which private names are resolved.
            timeout_s: time limit for one call to the master; None for no limit.
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
        """All `ROS_*` variables. They are read on first use, because only a few tools need them."""
        if self._environment is None:
            from pipros.basics.env import Environment

            self._environment = Environment.from_os()
        return self._environment

    def resolve(self, name: str) -> str:
        """Resolve a name from the command line to its global name."""
        return names.resolve(name, self._node_name)

    @property
    def master(self) -> MasterClient:
        """The master client, which connects on its first call.

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
