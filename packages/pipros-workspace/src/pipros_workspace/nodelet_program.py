"""The program `nodelet`: runs nodelets in Python, or starts the genuine program for C++ plugins."""

from __future__ import annotations

import logging
import os
import sys
import threading
import uuid
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

from pipros.basics import names
from pipros.basics.errors import Interrupted, PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c, forget_handlers
from pipros.msg import load_service_class
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros.node.service_server import CallFailed
from pipros.packages.nodelets import GENUINE, OURS, InvalidChoice, chosen, python_nodelet
from pipros.packages.system_packages import program
from pipros_libraries.bonds.node_bond import NodeBond
from pipros_libraries.nodelets.as_node import run_alone
from pipros_libraries.nodelets.hosting import CannotLoad, Hosting
from pipros_libraries.nodes.kept_memory import keep_freed_memory
from pipros_workspace.compiled_nodelets import loadable_nodelets
from pipros_workspace.program_start import command_of, environment_of

USAGE = """nodelet usage:
nodelet load pkg/Type manager [--no-bond]  - Launch a nodelet of type pkg/Type on manager manager
nodelet standalone pkg/Type   - Launch a nodelet of type pkg/Type in a standalone node
nodelet unload name manager   - Unload a nodelet by name from manager
nodelet manager               - Launch a nodelet manager node"""

_WORDS = {"load": 3, "standalone": 2, "unload": 3, "manager": 1}


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand of `nodelet`. Return the exit code."""
    argv = sys.argv[1:] if argv is None else argv
    words = [word for word in argv if ":=" not in word]
    command = words[0] if words else ""
    if len(words) < _WORDS.get(command, len(words) + 1):
        print("Your usage: ", " ".join(sys.argv), USAGE, sep="\n")
        return FAILED
    try:
        choice = chosen()
    except InvalidChoice as error:
        print(f"nodelet: {error}", file=sys.stderr)
        return FAILED
    if choice == GENUINE or (choice != OURS and command == "standalone" and _is_only_compiled(words[1])):
        return _run_genuine(argv)
    return _run(words, argv)


def _run(words: Sequence[str], argv: Sequence[str]) -> int:
    command, *rest = words
    if command in ("manager", "standalone"):
        keep_freed_memory()  # for images and clouds
    if command == "manager":
        with roscpp_program("manager", "nodelet", argv) as (node, log):
            Manager(node, log)
            node.wait_for_shutdown()
        return 0
    if command == "unload":
        with roscpp_program("nodelet_unloader", "nodelet", argv) as (node, log):
            return unload(node, log, rest[0], rest[1])
    name = rest[0].replace("/", "_")
    with roscpp_program(name, "nodelet", argv) as (node, log):
        if command == "standalone":
            return run_alone(node, log, rest[0], rest[1:])
        has_bond = rest[2:3] != ["--no-bond"]
        return load(node, log, rest[0], rest[1], rest[2 if has_bond else 3 :], has_bond=has_bond)


def _is_only_compiled(plugin: str) -> bool:
    return python_nodelet(plugin) is None and plugin in loadable_nodelets()


def _run_genuine(argv: Sequence[str]) -> int:
    """Replace this process with the genuine program. Return the exit code if the program is not installed."""
    found = program("nodelet", "nodelet")
    if found is None:
        print(
            "nodelet: the genuine program is not installed. Try: apt-get install libnodeletlib-tools",
            file=sys.stderr,
        )
        return FAILED
    sys.stdout.flush()
    command = command_of(Path(found), argv)
    forget_handlers()
    return os.execve(command[0], command, environment_of(Path(found), os.environ))  # noqa: S606  # no shell


FAILED: Final = 255
"""Exit code of failed commands."""

WAIT_S: Final = 10.0
"""Interval between warnings about a missing manager, and timeout of `nodelet unload`."""

_UNLOAD_S: Final = 0.4
"""How long a loader that shuts down waits for the manager to unload the nodelet."""


def manager_name(node: Node, manager: str) -> str:
    """Return the full name of a manager, as `nodelet load` resolves it."""
    return names.resolve(manager, node.name, node.identity.remappings)


def load(
    node: Node, log: logging.Logger, plugin: str, manager: str, arguments: Sequence[str], *, has_bond: bool
) -> int:
    """Request that a manager load a nodelet with the node's name, and wait until the node is shut down.

    Return the exit code.

    Args:
        arguments: the nodelet's command-line arguments.
        has_bond: whether to form a bond. The manager then unloads the nodelet if this process dies, and the
            node is shut down if the nodelet ends.
    """
    own = node.identity.remappings
    log.info(
        "Loading nodelet %s of type %s to manager %s with the following remappings:%s",
        node.name,
        plugin,
        manager,
        "".join(f"\n{source} -> {target}" for source, target in own.items()),
    )
    place = manager_name(node, manager)
    service = load_service_class("nodelet/NodeletLoad")
    client = node.client(f"{place}/load_nodelet", service)
    bond_id = f"{node.name}_{uuid.uuid4()}" if has_bond else ""

    def pause(seconds: float) -> None:
        if node.wait_for_shutdown(seconds):  # in real time: the node's clock may be simulated
            raise Interrupted(f"{node.name} was shut down while it waited for the manager")

    try:
        while not client.wait_until_available(WAIT_S, pause=pause, report=log.warning):
            log.warning("Waiting for service %s to be available...", client.service)
        client.call(
            service._request_class(node.name, plugin, [*own], [*own.values()], list(arguments), bond_id)
        )
    except Interrupted:
        return 0
    except PiprosError as error:
        if node.is_shutdown:
            return 0
        log.critical(
            "Failed to load nodelet '%s' of type '%s' to manager '%s': %s", node.name, plugin, manager, error
        )
        return FAILED
    _wait_for_end(node, log, place, bond_id)
    return 0


def _wait_for_end(node: Node, log: logging.Logger, place: str, bond_id: str) -> None:
    """Wait until the node is shut down, and unload its nodelet unless the bond is broken.

    If there is a bond, shut the node down when the bond is broken. `bond_id` is empty if there is no bond.
    """
    broken = threading.Event()
    bond: NodeBond | None = None

    def end() -> None:
        if not broken.is_set():
            _unload(node, log, place, node.name, _UNLOAD_S)

    # Register this hook before the bond's hook, so that the nodelet has ended when the bond is broken.
    node.on_shutdown(end)
    if bond_id:

        def on_broken() -> None:
            broken.set()
            log.info("Bond broken, exiting")
            node.shutdown_async("the bond is broken")

        bond = NodeBond(node, f"{place}/bond", bond_id, on_broken)
    node.wait_for_shutdown()
    del bond


def unload(node: Node, log: logging.Logger, name: str, manager: str) -> int:
    """Request that a manager unload a nodelet. Return the exit code."""
    log.info("Unloading nodelet %s from manager %s", name, manager)
    if _unload(node, log, manager_name(node, manager), name, WAIT_S):
        return 0
    log.critical("Failed to unload nodelet '%s' from manager '%s'", name, manager)
    return FAILED


def _unload(node: Node, log: logging.Logger, place: str, name: str, timeout_s: float) -> bool:
    service: Any = load_service_class("nodelet/NodeletUnload")
    try:
        node.client(f"{place}/unload_nodelet", service).call(service._request_class(name), timeout_s)
    except PiprosError as error:
        log.warning(
            "Couldn't find service %s/unload_nodelet, perhaps the manager is already shut down", place
        )
        log.debug("%s", error)
        return False
    return True


class Manager:
    """Serves `~load_nodelet`, `~unload_nodelet` and `~list`, and `~inputs` for `pipros doctor`."""

    def __init__(self, node: Node, log: logging.Logger) -> None:
        """Offer the services. Blocks until the master answers."""
        self._node = node
        self._log = log
        self._hosting = Hosting(node)
        self._bonds: dict[str, NodeBond] = {}
        self._lock = threading.Lock()
        for name, kind, handler in (
            ("load_nodelet", "nodelet/NodeletLoad", self._load),
            ("unload_nodelet", "nodelet/NodeletUnload", self._unload),
            ("list", "nodelet/NodeletList", self._list),
            ("inputs", "std_srvs/Trigger", self._inputs),
        ):
            node.serve(f"~{name}", load_service_class(kind), handler)

    def _load(self, request: Any) -> Any:
        resolve = self._node.resolve
        pairs = zip(request.remap_source_args, request.remap_target_args, strict=False)
        try:
            self._hosting.load(
                request.name,
                request.type,
                remappings={resolve(source): resolve(target) for source, target in pairs},
                arguments=request.my_argv,
            )
        except CannotLoad as error:
            self._log.error("Failed to load nodelet [%s] of type [%s]: %s", request.name, request.type, error)
            self._log.debug("", exc_info=error)
            raise CallFailed from error
        self._log.info("nodelet %s (%s) runs in Python", request.name, request.type)
        if request.bond_id:
            bond = NodeBond(
                self._node, "~bond", request.bond_id, partial(self._on_broken, request.name, request.bond_id)
            )
            with self._lock:
                self._bonds[request.name] = bond
        return load_service_class("nodelet/NodeletLoad")._response_class(True)

    def _on_broken(self, name: str, bond_id: str) -> None:
        with self._lock:
            bond = self._bonds.get(name)
            if bond is None or bond.bond_id != bond_id:
                return  # the nodelet was unloaded, or loaded again by another loader
            del self._bonds[name]
        self._log.info("unloading nodelet %s, because its bond is broken", name)
        self._hosting.unload(name)

    def _unload(self, request: Any) -> Any:
        with self._lock:
            bond = self._bonds.pop(request.name, None)
        if not self._hosting.unload(request.name):
            self._log.error("Failed to find nodelet with name '%s' to unload.", request.name)
            raise CallFailed
        if bond is not None:
            bond.break_bond()
        return load_service_class("nodelet/NodeletUnload")._response_class(True)

    def _list(self, _: Any) -> Any:
        return load_service_class("nodelet/NodeletList")._response_class(self._hosting.names())

    def _inputs(self, _: Any) -> Any:
        """Reply with a line for each nodelet: its name, its plugin, and the state of its inputs."""
        states = self._hosting.watch.states()
        lines = []
        for node, plugin in self._hosting.loaded():
            inputs = [str(state) for state in states if state.nodelet == node.name]
            lines.append(f"{node.name} ({plugin}): {'; '.join(inputs) or 'no input'}")
        return load_service_class("std_srvs/Trigger")._response_class(True, "\n".join(lines))
