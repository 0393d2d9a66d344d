"""The scope that an element in a launch file inherits: namespace, arguments, remappings and environment.

`<group>` and `<include>` open a new scope; declarations inside have no effect outside.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from pipros.basics import names
from pipros_tools.launch.model import Argument
from pipros_tools.launch.substitute import Substitution


@dataclass(slots=True, eq=False, repr=False)
class LaunchScope:
    """The scope of an element.

    Attributes:
        namespace: the namespace, with a leading and a trailing slash.
        file: the current file, as shown in messages.
        substitution: holds the arguments of this scope.
        declared: the names of the `<arg>`s read so far in this file.
        given: arguments from the command line or the `<include>`, which an `<arg>` with a `value` must not
            override.
        passed_all: whether a `value` may override the `given` arguments, as with `pass_all_args`.
        remappings: pairs (from, to) by `from`, in the order of declaration. A later pair replaces an earlier
            one with the same `from`.
        environment: pairs (name, value) in the order of declaration.
        private_params: parameters `~name` declared outside of nodes, which apply to every later node.
        default_machine: the machine for nodes that have no `machine` attribute.
    """

    namespace: str
    file: str
    substitution: Substitution
    declared: set[str] = field(default_factory=set)
    given: frozenset[str] = frozenset()
    passed_all: bool = False
    remappings: dict[str, tuple[str, str]] = field(default_factory=dict)
    environment: list[tuple[str, str]] = field(default_factory=list)
    private_params: dict[str, Any] = field(default_factory=dict)
    default_machine: str = ""

    @property
    def arguments(self) -> dict[str, str | None]:
        """The arguments' values, for `$(arg x)`; None for arguments declared without a value."""
        return self.substitution.arguments

    def child(self, namespace: str = "") -> LaunchScope:
        """Return a new scope, below `namespace`, that inherits everything else from this scope."""
        return replace(
            self,
            namespace=self._below(namespace),
            substitution=replace(self.substitution, arguments=dict(self.arguments)),
            declared=set(self.declared),
            remappings=dict(self.remappings),
            environment=list(self.environment),
            private_params=dict(self.private_params),
        )

    def included(
        self, namespace: str, file: str, folder: str | None, given: dict[str, str | None], *, passed_all: bool
    ) -> LaunchScope:
        """Return the scope for an included file: a child with only the given arguments."""
        scope = self.child(namespace)
        scope.file = file
        scope.declared = set()
        scope.given = frozenset(given)
        scope.passed_all = passed_all
        scope.substitution = replace(self.substitution, arguments=dict(given), folder=folder, anonymous={})
        return scope

    def declare(self, argument: Argument) -> None:
        """Declare an `<arg>` and set its value.

        Raises:
            ValueError: the argument is already declared, or would override a given value.
        """
        name = argument.name
        if name in self.declared:
            raise ValueError(f"arg '{name}' has already been declared")
        self.declared.add(name)
        if argument.value is not None:
            if name in self.given and not self.passed_all:
                raise ValueError(f"cannot override arg '{name}', which has already been set")
            self.arguments[name] = argument.value
        elif name not in self.arguments:
            self.arguments[name] = argument.default

    def remap(self, source: str, target: str) -> None:
        """Add a remapping for all later nodes in this scope.

        Raises:
            ValueError: a name is empty or illegal.
        """
        source, target = checked_remapping(source, target)
        self.remappings.pop(source, None)
        self.remappings[source] = source, target

    def resolve_param(self, name: str) -> str:
        """Resolve a parameter's name to its full name in this scope; `~name` is returned unchanged."""
        if names.is_private(name):
            return names.canonicalize(name)
        return names.canonicalize(names.join(self.namespace, name)) or "/"

    def resolve_private(self, key: str) -> str:
        """Return the full name of a resolved parameter in a node's scope, to which `~name` is private."""
        return self.resolve_param(key[1:].lstrip("/")) if names.is_private(key) else key

    def _below(self, namespace: str) -> str:
        if not namespace:
            return self.namespace
        return names.make_global_namespace(names.canonicalize(names.join(self.namespace, namespace)))


def checked_remapping(source: str, target: str) -> tuple[str, str]:
    """Return a `<remap>`'s names in canonical form.

    Raises:
        ValueError: a name is empty or illegal.
    """
    source, target = names.canonicalize(source), names.canonicalize(target)
    if not source or not target:
        raise ValueError("remap from/to attributes cannot be empty")
    for which, name in (("from", source), ("to", target)):
        if not names.is_legal(name):
            raise ValueError(f"remap {which} [{name}] is not a valid ROS name")
    return source, target
