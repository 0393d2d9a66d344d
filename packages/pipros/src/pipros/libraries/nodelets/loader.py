"""`nodelet load`, which runs a node that represents a nodelet in a manager, and `nodelet unload`."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Sequence
from typing import Any, Final

from pipros.basics import names
from pipros.basics.errors import Interrupted, PiprosError
from pipros.libraries.bonds.node_bond import NodeBond
from pipros.msg import load_service_class
from pipros.node import Node

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
