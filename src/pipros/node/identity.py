"""The name of a node, and how it resolves other names with its command line and environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pipros import names
from pipros.env import Environment
from pipros.errors import InvalidName

UNNAMED = "unnamed"
"""The base name of a process that has not started a node."""


@dataclass(frozen=True, slots=True)
class Identity:
    """A node's names, settled once for its whole life.

    Attributes:
        name: the full name: `/robot/talker`.
        namespace: of the node, with a slash at the end: `/robot/`.
        arguments: the command line, sorted.
        remappings: what the command line renames, as global names.
        environment: the variables, with the changes of `__master:=` and the like.
    """

    name: str
    namespace: str
    arguments: names.Arguments
    remappings: Mapping[str, str]
    environment: Environment

    @classmethod
    def settle(cls, name: str, *, anonymous: bool, argv: Sequence[str], environment: Environment) -> Identity:
        """`__name:=` and `__ns:=` win over the name given and over `ROS_NAMESPACE`.

        `__name:=` may have a namespace, which the node is then in, as in rospy.

        Raises:
            InvalidName: a name with a namespace in it that is not from `__name:=`, or none.
        """
        arguments = names.parse_arguments(argv)
        special = arguments.special
        if not name or "/" in name:
            raise InvalidName(f"[{name}] is not a node name: it must be a name without a namespace")
        if "__name" in special:
            name = special["__name"]
        elif anonymous:
            name = names.anonymous(name)
        namespace = names.make_global_namespace(special.get("__ns", environment.namespace))
        full_name = names.canonicalize(names.join(namespace, name))
        if full_name == "/":
            raise InvalidName(f"[{name}] is not a node name: it has no letters")
        namespace = names.namespace(full_name)
        if "__hostname" in special or "__ip" in special:
            environment = replace(environment, hostname=special.get("__hostname"), ip=special.get("__ip"))
        return cls(
            full_name,
            namespace,
            arguments,
            names.resolve_remappings(arguments.remappings, full_name),
            replace(environment, master_uri=special.get("__master", environment.master_uri)),
        )

    @classmethod
    def unnamed(cls, *, argv: Sequence[str], environment: Environment) -> Identity:
        """The identity of a process before its node has a name.

        Names resolve without remappings, as in rospy: they may mention the node's name. The topics
        made at that time are an exception, see `resolve_topic_without_name`.
        """
        arguments = names.parse_arguments(argv)
        namespace = names.make_global_namespace(arguments.special.get("__ns", environment.namespace))
        return cls(namespace + UNNAMED, namespace, arguments, {}, environment)

    def resolve(self, name: str) -> str:
        """The global name that `name` means in this node, remappings applied."""
        return self.resolve_for(self.name, name)

    def resolve_for(self, node_name: str, name: str) -> str:
        """As `resolve`, for a relative or private name of the node `node_name`.

        Nodes resolve two private names otherwise than the rest of ROS does, in rospy's way: `~` ends in a
        slash, and `~/x` is `/x`.
        """
        if names.is_private(name):
            name = names.canonicalize(name)
            name = names.join(node_name, name[1:])
            return self.remappings.get(name, name)
        return names.resolve(name, node_name, self.remappings)

    def resolve_topic_without_name(self, topic: str) -> str:
        """The global name of a topic that is made before the node has its name, remappings applied.

        Raises:
            InvalidName: for a private name.
        """
        if names.is_private(topic):
            raise InvalidName("~name topics cannot be created before init_node() has been called")
        resolved = names.resolve(topic, self.name)
        return names.resolve_remappings(self.arguments.remappings, self.name).get(resolved, resolved)

    def remap(self, name: str, node_name: str) -> str:
        """What a remapping argument that reads just like `name` makes of it; `name` without one."""
        new = self.arguments.remappings.get(name)
        return name if new is None else names.resolve(new, node_name)
