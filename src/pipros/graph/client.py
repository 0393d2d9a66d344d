"""The connection of a tool to a running system: environment, master client, resolution of names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipros import names
from pipros.env import Environment, split_master_uri

if TYPE_CHECKING:
    from pipros.net.master_client import MasterClient


class GraphClient:
    """The environment, the master client and the name resolution of a tool.

    A context manager that closes the connections to the master.
    """

    def __init__(self, tool: str, environment: Environment | None = None) -> None:
        """`tool` is the name below which private names are resolved: `rostopic`."""
        self.environment = environment or Environment.from_os()
        self.caller_id = f"/{tool}"
        self._node_name = names.join(self.environment.namespace, tool)
        self._master: MasterClient | None = None

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

            split_master_uri(self.environment.master_uri)
            self._master = MasterClient(self.environment.master_uri, self.caller_id)
        return self._master

    def __enter__(self) -> GraphClient:
        return self

    def __exit__(self, *_: object) -> None:
        if self._master is not None:
            self._master.close()
