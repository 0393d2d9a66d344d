"""One side of a bond that a node forms over a topic, as in Noetic's package bond."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.bonds.life import BondEvent, BondState
from pipros_libraries.bonds.side import BondSide

_SENT_QUEUE, _RECEIVED_QUEUE = 5, 30


class NodeBond:
    """One side of a bond. The bond is formed with the first other side that uses the same topic and ID."""

    def __init__(self, node: Node, topic: str, bond_id: str, on_broken: Callable[[], object]) -> None:
        """Start the bond.

        Args:
            on_broken: called once, in any thread, when the bond is broken or was not formed within 10 s. Not
                called if the node is being shut down.
        """
        constants: Any = load_message_class("bond/Constants")
        self._constants = constants
        self._status: Any = load_message_class("bond/Status")
        self._node = node
        self.bond_id = bond_id
        self._instance = str(uuid.uuid4())
        self._on_broken = on_broken
        self._timeout_s = float(constants.DEFAULT_HEARTBEAT_TIMEOUT)
        self._period_s = float(constants.DEFAULT_HEARTBEAT_PERIOD)
        self._side = BondSide(
            {
                BondEvent.CONNECT_TIMEOUT: float(constants.DEFAULT_CONNECT_TIMEOUT),
                BondEvent.HEARTBEAT_TIMEOUT: self._timeout_s,
                BondEvent.DISCONNECT_TIMEOUT: float(constants.DEFAULT_DISCONNECT_TIMEOUT),
            },
            send=self._send,
            notify=self._notify,
            enter=lambda _: None,
            ignores_silence=self._ignores_silence,
            is_over=lambda: node.is_shutdown,
        )
        self._side.start_timeout()
        self._publisher = node.advertise(topic, self._status, queue_size=_SENT_QUEUE)
        self._subscriber = node.subscribe(topic, self._status, self._receive, queue_size=_RECEIVED_QUEUE)
        node.on_shutdown(self._end)
        threading.Thread(target=self._run, name=f"bond {bond_id}", daemon=True).start()

    def break_bond(self) -> None:
        """Notify the other side that this side is ending. Does not block; may be called repeatedly."""
        self._side.handle(BondEvent.BREAK)

    def _run(self) -> None:
        self._side.publish_heartbeats(self._period_s, float(self._constants.DEAD_PUBLISH_PERIOD))
        self._node.remove_shutdown_hook(self._end)
        self._subscriber.unregister()
        self._publisher.unregister()

    def _end(self) -> None:
        self.break_bond()
        self._side.wake()

    def _receive(self, message: Any) -> None:
        if message.id == self.bond_id and message.instance_id != self._instance:
            is_sister = self._side.receive(message.instance_id, bool(message.active))
            if is_sister and not message.active:
                self._side.handle(BondEvent.SISTER_ENDS)  # the other side was notified: no need to wait

    def _notify(self, state: BondState) -> None:
        if state is BondState.DEAD and not self._node.is_ending:
            self._on_broken()

    def _ignores_silence(self) -> bool:
        try:
            return bool(self._node.params.get(self._constants.DISABLE_HEARTBEAT_TIMEOUT_PARAM))
        except (LookupError, PiprosError):
            return False

    def _send(self, is_alive: bool) -> None:
        status = self._status(
            id=self.bond_id,
            instance_id=self._instance,
            active=is_alive,
            heartbeat_timeout=self._timeout_s,
            heartbeat_period=self._period_s,
        )
        status.header.stamp = stamp(self._node.clock)
        self._publisher.publish(status)
