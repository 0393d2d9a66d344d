"""Build a `Launch` from elements, and check that the elements do not conflict."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pipros_tools.launch.model import (
    Argument,
    Launch,
    LaunchError,
    LaunchNode,
    Machine,
    ParameterCommand,
    Place,
    Test,
)


class LaunchBuilder:
    """Collects the contents of all files; `finish` returns them as a `Launch`."""

    def __init__(self) -> None:
        self._files: list[str] = []
        self._params: dict[str, Any] = {}
        self._clear_params: list[str] = []
        self._commands: list[ParameterCommand] = []
        self._nodes: dict[str, LaunchNode] = {}
        self._tests: list[Test] = []
        self._machines: dict[str, Machine] = {}
        self._arguments: dict[str, Argument] = {}
        self._warnings: list[str] = []
        self._includes: list[tuple[str, str]] = []
        self._unused_private: dict[str, Place] = {}

    def add_file(self, file: str) -> None:
        if file not in self._files:
            self._files.append(file)

    def add_include(self, file: str, included: str) -> None:
        """Record that `file` includes `included`."""
        self._includes.append((file, included))

    def warn(self, *warnings: str) -> None:
        self._warnings.extend(warnings)

    def add_param(self, key: str, value: Any) -> None:
        """Set a parameter. The last value for a name wins.

        If a parent of `key` has a value that is not a dictionary, record a warning.
        """
        parent = key.rpartition("/")[0]
        while parent:
            if parent in self._params and not isinstance(self._params[parent], dict):
                self.warn(f"parameter [{key}] conflicts with parent parameter [{parent}]")
            parent = parent.rpartition("/")[0]
        self._params.pop(key, None)
        self._params[key] = value

    def declare_private(self, key: str, place: Place) -> None:
        """Record a parameter `~name` that was declared outside of nodes, for later nodes."""
        self._unused_private[key] = place

    def use_private(self, keys: Iterable[str]) -> None:
        """Record that a node has these parameters. `finish` warns about those that no node has."""
        for key in keys:
            self._unused_private.pop(key, None)

    def clear_params(self, namespace: str) -> None:
        if namespace not in self._clear_params:
            self._clear_params.append(namespace)

    def add_command(self, command: ParameterCommand) -> None:
        self._commands.append(command)

    def add_node(self, node: LaunchNode) -> None:
        """Add a node.

        Raises:
            LaunchError: another node has the same name.
        """
        first = self._nodes.get(node.full_name)
        if first is not None:
            places = [place for place in (node.place, first.place) if place]
            raise LaunchError(
                f"roslaunch file contains multiple nodes named [{node.full_name}].\n"
                "Please check all <node> 'name' attributes to make sure they are unique.\n"
                "Also check that $(anon id) use different ids."
                + "".join(f"\n  declared in {place}" for place in places)
            )
        self._nodes[node.full_name] = node

    def add_test(self, test: Test) -> None:
        self._tests.append(test)

    def add_machine(self, machine: Machine) -> None:
        """Add a machine.

        Raises:
            LaunchError: a different machine has the same name.
        """
        if self._machines.setdefault(machine.name, machine) != machine:
            raise LaunchError(
                f"Machine [{machine.name}] already added and does not match duplicate entry",
                [machine.place] if machine.place else (),
            )

    def add_argument(self, argument: Argument) -> None:
        self._arguments.setdefault(argument.name, argument)

    def finish(self) -> Launch:
        """Return the collected launch. Its machines have not been checked; see `Launch.check_machines`."""
        return Launch(
            files=tuple(self._files),
            params=dict(self._params),
            clear_params=tuple(self._clear_params),
            commands=tuple(self._commands),
            nodes=tuple(self._nodes.values()),
            tests=tuple(self._tests),
            machines=dict(self._machines),
            arguments=tuple(self._arguments.values()),
            warnings=(
                *self._warnings,
                *(
                    f"parameter [{key}] in {place} is set for no node: it applies to later nodes only"
                    for key, place in self._unused_private.items()
                ),
            ),
            includes=tuple(self._includes),
        )
