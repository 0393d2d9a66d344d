"""`nodelet manager`: loads nodelets on request, and unloads them when their loaders end."""

from __future__ import annotations

import logging
import threading
from functools import partial
from typing import Any

from pipros.libraries.bonds.node_bond import NodeBond
from pipros.libraries.nodelets.hosting import CannotLoad, Hosting
from pipros.msg import load_service_class
from pipros.node import Node
from pipros.node.service_server import CallFailed


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
