"""Who a node is: its name, and what its command line and environment make of other names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pipros import names
from pipros.env import Environment
from pipros.errors import InvalidName


@dataclass(frozen=True, slots=True)
class Identity:
    """A node's names, settled once for its whole life.

    Attributes:
        name: the full name: `/robot/talker`.
        namespace: where it stands, with a slash at the end: `/robot/`.
        arguments: the command line, sorted.
        remappings: what the command line renames, as global names.
        environment: the surroundings, with what `__master:=` and its kind change.
    """

    name: str
    namespace: str
    arguments: names.Arguments
    remappings: Mapping[str, str]
    environment: Environment

    @classmethod
    def settle(cls, name: str, *, anonymous: bool, argv: Sequence[str], environment: Environment) -> Identity:
        """`__name:=` and `__ns:=` win over the name given and over `ROS_NAMESPACE`.

        Raises:
            InvalidName: a name with a namespace in it, or none.
        """
        arguments = names.parse_arguments(argv)
        special = arguments.special
        if "__name" in special:
            name = special["__name"]
        elif anonymous:
            name = names.anonymous(name)
        if not name or "/" in name:
            raise InvalidName(f"[{name}] is no node name: it must be a name without a namespace")
        namespace = names.make_global_namespace(special.get("__ns", environment.namespace))
        full_name = names.canonicalize(namespace + name)
        if "__hostname" in special or "__ip" in special:
            environment = replace(environment, hostname=special.get("__hostname"), ip=special.get("__ip"))
        return cls(
            full_name,
            namespace,
            arguments,
            names.resolve_remappings(arguments.remappings, full_name),
            replace(environment, master_uri=special.get("__master", environment.master_uri)),
        )

    def resolve(self, name: str) -> str:
        """The global name that `name` means in this node, remappings applied."""
        return names.resolve(name, self.name, self.remappings)
