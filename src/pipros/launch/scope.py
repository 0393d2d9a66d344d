"""What one place in a launch file inherits: namespace, arguments, remappings, environment, private names.

`<group>` and `<include>` open a scope of their own; what is declared in it does not leak out.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from pipros import names
from pipros.launch.model import Argument
from pipros.launch.substitute import Substitution


@dataclass(slots=True)
class Scope:
    """The state of the loader at one element.

    Attributes:
        namespace: with a leading and a trailing slash.
        file: the file being read, as it is shown in messages.
        substitution: with the arguments of this scope.
        declared: the names of the `<arg>`s seen so far in this file.
        given: the arguments that came from outside and may not be overridden by a `value`.
        passed_all: whether outer arguments give way to a `value`, as under `pass_all_args`.
        remappings: (from, to), later ones of the same `from` replace earlier ones.
        environment: (name, value) in order.
        private_params: `~name` of `<param>`s outside of nodes; every later node gets them.
        default_machine: where nodes go that name no machine.
    """

    namespace: str
    file: str
    substitution: Substitution
    declared: set[str] = field(default_factory=set)
    given: frozenset[str] = frozenset()
    passed_all: bool = False
    remappings: list[tuple[str, str]] = field(default_factory=list)
    environment: list[tuple[str, str]] = field(default_factory=list)
    private_params: dict[str, Any] = field(default_factory=dict)
    default_machine: str = ""

    @property
    def arguments(self) -> dict[str, str | None]:
        """The values that `$(arg x)` has here; None for those declared without one."""
        return self.substitution.arguments

    def child(self, namespace: str = "") -> Scope:
        """A scope below this one, which sees everything and changes nothing here."""
        return replace(
            self,
            namespace=self._below(namespace),
            substitution=replace(self.substitution, arguments=dict(self.arguments)),
            declared=set(self.declared),
            remappings=list(self.remappings),
            environment=list(self.environment),
            private_params=dict(self.private_params),
        )

    def included(
        self, namespace: str, file: str, folder: str | None, given: dict[str, str | None], *, passed_all: bool
    ) -> Scope:
        """The scope of an included file: a child, but with the arguments given and nothing declared yet."""
        scope = self.child(namespace)
        scope.file = file
        scope.declared = set()
        scope.given = frozenset(given)
        scope.passed_all = passed_all
        scope.substitution = replace(self.substitution, arguments=dict(given), folder=folder, anonymous={})
        return scope

    def declare(self, argument: Argument) -> None:
        """Takes note of an `<arg>` and gives it the value that its rules lead to.

        Raises:
            ValueError: when it was declared before, or would override a value.
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
        """Adds a remapping for all nodes that follow in this scope.

        Raises:
            ValueError: for an empty or illegal name.
        """
        source, target = names.canonicalize(source), names.canonicalize(target)
        if not source or not target:
            raise ValueError("remap from/to attributes cannot be empty")
        for which, name in (("from", source), ("to", target)):
            if not names.is_legal(name):
                raise ValueError(f"remap {which} [{name}] is not a valid ROS name")
        self.remappings = [pair for pair in self.remappings if pair[0] != source]
        self.remappings.append((source, target))

    def resolve_param(self, name: str) -> str:
        """The full name of a parameter that is written here; `~name` stays as it is."""
        if names.is_private(name):
            return names.canonicalize(name)
        return names.canonicalize(names.join(self.namespace, name)) or "/"

    def _below(self, namespace: str) -> str:
        if not namespace:
            return self.namespace
        return names.make_global_namespace(names.canonicalize(names.join(self.namespace, namespace)))
