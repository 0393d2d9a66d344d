"""Messages that a launcher prints before it starts anything: warnings, details and the summary."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pipros.basics.env import split_master_uri
from pipros.basics.printable import listed
from pipros.net import address
from pipros_tools.launch.console import Console
from pipros_tools.launch.model import Launch, LaunchNode

_VALUE_CHARACTERS = 20


def announce_launch(console: Console, launch: Launch, *, local_only: bool) -> None:
    """Print a launch's warnings. Write details to the log file and, with `-v`, to the terminal."""
    for warning in launch.warnings:
        console.error(f"WARNING: {warning}")
    for file in launch.files:
        console.detail(f"... loading XML file [{file}]")
    for key in launch.params:
        console.detail(f"Added parameter [{key}]")
    for node in launch.nodes:
        console.detail(f"Added node of type [{node.package}/{node.type}] in namespace [{node.namespace}]")
    if local_only:
        console.say("local only launch specified, will not launch remote nodes")


def warn_about_arguments(
    console: Console, launch: Launch, arguments: Iterable[str], files: Sequence[str]
) -> None:
    """Warn about command-line arguments that no file declares, except those of a node, such as `__name`."""
    declared = {argument.name for argument in launch.arguments}
    for name in arguments:
        if name not in declared and files and not name.startswith("__"):
            console.error(f"WARNING: no <arg> named [{name}] is declared in {', '.join(files)}")


def warn_about_machines(console: Console, launch: Launch, master_uri: str) -> None:
    """Warn if other machines cannot reach the master, or if a machine has a password, which is ignored."""
    host, _ = split_master_uri(master_uri)
    if address.is_loopback(host):
        console.error(
            f"WARNING: nodes on other machines cannot reach the master at {master_uri}; "
            "use a name of this computer that they can resolve in ROS_MASTER_URI"
        )
    for machine in launch.machines.values():
        if machine.password:
            console.error(
                f"WARNING: the password of machine [{machine.name}] is ignored: ssh accepts no password from "
                "a launch file. Set up a key (ssh-copy-id) or an agent"
            )


def summary(
    params: Mapping[str, Any],
    nodes: Iterable[LaunchNode],
    *,
    machines: Iterable[str] = (),
    is_core: bool = False,
    cleared: Iterable[str] = (),
    has_machines: bool = False,
) -> str:
    """Return the lists of parameters, machines and nodes in Noetic's format.

    Args:
        is_core: whether to begin with an additional empty line, as `roscore` does.
        cleared: namespaces whose parameters are deleted first.
        has_machines: whether to print the list of machines even if it is empty.
    """
    lines = ["", "SUMMARY", "========", ""]
    if is_core:
        lines.insert(0, "")
    if namespaces := sorted(cleared):
        lines += ["CLEAR PARAMETERS", *(f" * {listed(namespace)}" for namespace in namespaces), ""]
    if params:
        lines += ["PARAMETERS", *(f" * {listed(key)}: {_short(params[key])}" for key in sorted(params)), ""]
    if (names := sorted(machines)) or has_machines:
        lines += ["MACHINES", *([f" * {listed(name)}" for name in names] or [""]), ""]
    lines += ["NODES"]
    below: dict[str, list[str]] = {}
    for node in nodes:
        below.setdefault(node.namespace, []).append(
            f"    {listed(node.name)} ({listed(node.package)}/{listed(node.type)})"
        )
    for namespace in sorted(below):
        lines += [f"  {namespace}", *sorted(below[namespace])]
    return "\n".join([*lines, ""])


def _short(value: Any) -> str:
    """Return a value on one line, truncated to 20 characters, or `<...>` if it is not printable ASCII."""
    text = (value.decode("latin-1") if isinstance(value, bytes) else str(value)).strip()
    if len(text) > _VALUE_CHARACTERS:
        text = text[: _VALUE_CHARACTERS - 3] + "..."
    return text if text.isascii() and text.isprintable() else "<...>"
