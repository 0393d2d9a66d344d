"""Determine a node's name and resolve other names, based on its command line and environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.basics.errors import InvalidName

UNNAMED = "unnamed"
"""Base name used by a process that has not started a node."""


class Identity(NamedTuple):
    """A node's names, determined once.

    Attributes:
        name: the full name, such as `/robot/talker`.
        namespace: the node's namespace with a trailing slash, such as `/robot/`.
        arguments: the classified command line.
        remappings: the command-line remappings, as global names.
        environment: the environment variables, with changes by `__master:=` and similar arguments.
    """

    name: str
    namespace: str
    arguments: names.Arguments
    remappings: Mapping[str, str]
    environment: Environment

    @classmethod
    def from_arguments(
        cls, name: str, *, anonymous: bool, argv: Sequence[str], environment: Environment
    ) -> Identity:
        """Determine a node's names.

        `__name:=` and `__ns:=` take precedence over `name` and `ROS_NAMESPACE`. `__name:=` may include a
        namespace, which then applies to the node, as in rospy.

        Raises:
            InvalidName: the name is empty or consists of slashes only, or includes a namespace but was not
                given by `__name:=`; or the namespace is private.
        """
        arguments = names.parse_arguments(argv)
        special = arguments.special
        if not name or "/" in name:
            raise InvalidName(f"[{name}] is not a node name: it must be a name without a namespace")
        if "__name" in special:
            name = special["__name"]
        elif anonymous:
            name = names.anonymous(name)
        if names.is_private(name):
            name = f"/{UNNAMED}/{name[1:]}"  # as in rospy, in which the node is not yet named
        namespace = names.make_global_namespace(special.get("__ns", environment.namespace))
        full_name = names.canonicalize(names.join(namespace, name))
        if full_name == "/":
            raise InvalidName(f"[{name}] is not a node name: it must not consist of slashes only")
        namespace = names.namespace(full_name)
        if "__hostname" in special or "__ip" in special:
            environment = environment._replace(hostname=special.get("__hostname"), ip=special.get("__ip"))
        return cls(
            full_name,
            namespace,
            arguments,
            names.resolve_remappings(arguments.remappings, full_name),
            environment._replace(master_uri=special.get("__master", environment.master_uri)),
        )

    @classmethod
    def unnamed(cls, *, argv: Sequence[str], environment: Environment) -> Identity:
        """Return the identity of a process before its node has a name.

        As in rospy, names resolve without remappings, because a remapping may depend on the node's name.
        Topics created at that time are an exception; see `resolve_topic_without_name`.
        """
        arguments = names.parse_arguments(argv)
        namespace = names.make_global_namespace(arguments.special.get("__ns", environment.namespace))
        return cls(namespace + UNNAMED, namespace, arguments, {}, environment)

    def resolve(self, name: str) -> str:
        """Resolve `name` to a global name in this node, and apply the remappings."""
        return self.resolve_for(self.name, name)

    def resolve_for(self, node_name: str, name: str) -> str:
        """Resolve `name` as `resolve` does, relative to the node `node_name`.

        As in rospy, two private names resolve differently from the rest of ROS: `~` to the node's name with a
        trailing slash, and `~/x` to `/x`.
        """
        if names.is_private(names.text_of(name)):
            name = names.canonicalize(name)
            name = names.join(node_name, name[1:])
            return self.remappings.get(name, name)
        return names.resolve(name, node_name, self.remappings)

    def resolve_topic_without_name(self, topic: str) -> str:
        """Return the remapped global name of a topic that is created before the node has its name.

        Raises:
            InvalidName: the name is private.
        """
        if names.is_private(names.text_of(topic)):
            raise InvalidName("~name topics cannot be created before init_node() has been called")
        resolved = names.resolve(topic, self.name)
        return names.resolve_remappings(self.arguments.remappings, self.name).get(resolved, resolved)

    def remap(self, name: str, node_name: str) -> str:
        """Return the target, as a global name, of the remapping argument whose source is literally `name`.

        Without such an argument, return `name` unchanged.
        """
        new = self.arguments.remappings.get(name)
        return name if new is None else names.resolve(new, node_name)
