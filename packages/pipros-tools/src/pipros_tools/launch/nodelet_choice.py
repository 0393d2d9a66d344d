"""Choose between Python and the genuine C++ program for each nodelet manager of a launch.

All nodelets of a manager share its process, so they are either all in Python or all C++ plugins. Python is
chosen if pipros provides all of them in Python, or if not all of the C++ plugins are installed. In the latter
case, loading a nodelet that is not available in Python fails with an error that names the nodelet's package.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from pipros.basics import names
from pipros.basics.words import split_words
from pipros.packages.nodelets import (
    CHOICE_VARIABLE,
    GENUINE,
    OURS,
    InvalidChoice,
    chosen,
    python_nodelet,
)
from pipros.packages.well_known import why_no_nodelet
from pipros_tools.launch.model import Launch, LaunchNode
from pipros_workspace.compiled_nodelets import loadable_nodelets

_WHY_MIXED = (
    f"The nodelet {{}} is a C++ plugin, but its manager is in Python, because {CHOICE_VARIABLE} says so, or "
    "because not all of its other nodelets are installed as C++ plugins. Use another manager for it."
)


@dataclass(frozen=True, slots=True)
class NodeletArguments:
    """The arguments of a node that runs `nodelet`.

    Attributes:
        command: `load`, `standalone`, `manager` or another word.
        plugin: the nodelet type to load; empty for commands that load none.
        manager: the full name of the manager, for `load`.
    """

    command: str
    plugin: str = ""
    manager: str = ""


def arguments_of(node: LaunchNode) -> NodeletArguments | None:
    """Return the arguments if the node runs `nodelet` with a subcommand, otherwise None."""
    if (node.package, node.type) != ("nodelet", "nodelet"):
        return None
    try:
        words = [word for word in split_words(node.arguments) if ":=" not in word]
    except ValueError:  # the error is reported when the node is started
        return None
    match words:
        case ["load", plugin, manager, *_]:
            return NodeletArguments("load", plugin, names.resolve(manager, node.full_name))
        case ["standalone", plugin, *_]:
            return NodeletArguments("standalone", plugin)
        case [command, *_]:
            return NodeletArguments(command)
    return None


def with_choices(
    launch: Launch,
    compiled: Callable[[], Mapping[str, str]] = loadable_nodelets,
    variables: Mapping[str, str] = os.environ,
) -> tuple[Launch, Sequence[str]]:
    """Return the launch with `PIPROS_NODELETS` set for its managers and nodelets, and lines for the log.

    Nodes that already set the variable keep its value. The lines name the nodelets that run in Python.

    Args:
        compiled: function that returns the installed C++ plugins, and the package of each.
    """
    found = {node.full_name: each for node in launch.nodes if (each := arguments_of(node))}
    if not found:
        return launch, ()
    general = variables.get(CHOICE_VARIABLE, "")
    plugins = {
        name: [each.plugin for each in found.values() if each.manager == name]
        for name, manager in found.items()
        if manager.command == "manager"
    }
    choices = dict.fromkeys(plugins, general)
    if not general:
        for name, wanted in plugins.items():
            if not all(map(python_nodelet, wanted)):
                installed = compiled()
                choices[name] = GENUINE if all(each in installed for each in wanted) else OURS
    nodes = []
    lines = []
    for node in launch.nodes:
        each = found.get(node.full_name)
        choice = choices.get(each.manager or node.full_name, general) if each else ""
        if choice and CHOICE_VARIABLE not in dict(node.environment):
            node = replace(node, environment=(*node.environment, (CHOICE_VARIABLE, choice)))
        if each and each.plugin and choice != GENUINE and python_nodelet(each.plugin):
            lines.append(f"nodelet {node.full_name} ({each.plugin}) runs in Python")
        nodes.append(node)
    return replace(launch, nodes=tuple(nodes)), lines


def why_not_loadable(node: LaunchNode, variables: Mapping[str, str]) -> str | None:
    """Return the reason why a node's nodelet cannot be loaded, or None if it can.

    Args:
        variables: the node's environment variables.
    """
    each = arguments_of(node)
    try:
        choice = chosen(variables)
    except InvalidChoice as error:
        return str(error) if each else None
    if each is None or not each.plugin or choice == GENUINE or python_nodelet(each.plugin):
        return None
    if each.plugin in loadable_nodelets():
        return None if choice != OURS else _WHY_MIXED.format(each.plugin)
    return why_no_nodelet(each.plugin)
