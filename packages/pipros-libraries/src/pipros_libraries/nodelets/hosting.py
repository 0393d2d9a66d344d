"""Start and stop nodelets in the process of one node."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final, NamedTuple

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.node import Node
from pipros.node.hosted_node import HostedNode
from pipros.node.log import ros_logger
from pipros.packages.nodelets import python_nodelet
from pipros.packages.well_known import why_no_nodelet

NODELETS: Final = 250
"""Limit: the nodelets of one process, because any node can load some, and each has threads."""


class CannotLoad(PiprosError):
    """A nodelet is unknown, one too many, or cannot be constructed, or its name is illegal or in use."""


class Hosting:
    """The nodelets of one process, by name. Methods may be called from any thread."""

    def __init__(self, host: Node) -> None:
        """Prepare a running node to host nodelets."""
        self._host = host
        self._nodelets: dict[str, HostedNode | None] = {}  # None while a nodelet is being constructed
        self._types: dict[str, str] = {}
        self._lock = threading.Lock()
        self.watch = InputWatch(host, self.loaded)
        host.hand_over_messages()

    def names(self) -> list[str]:
        """Return the full names of the nodelets, sorted."""
        return sorted(self._nodelets)

    def loaded(self) -> list[tuple[HostedNode, str]]:
        """Return the nodelets with their plugin names, sorted by name."""
        with self._lock:
            return [(node, self._types[name]) for name, node in sorted(self._nodelets.items()) if node]

    def load(
        self,
        name: str,
        plugin: str,
        *,
        remappings: Mapping[str, str] | None = None,
        arguments: Sequence[str] = (),
    ) -> None:
        """Construct a nodelet.

        Args:
            name: the nodelet's full name.
            remappings: maps global names to global names.
            arguments: the nodelet's command-line arguments.

        Raises:
            CannotLoad: the plugin has no Python class, a name is illegal or in use, its constructor fails, or
                there are too many nodelets.
        """
        for each in (name, *(remappings or {}), *(remappings or {}).values()):
            if not names.is_legal(names.canonicalize(each)):
                raise CannotLoad(f"[{printable(each)}] is not a legal name")
        with self._lock:
            if name in self._nodelets:
                raise CannotLoad(f"a nodelet named [{name}] is already loaded")
            if len(self._nodelets) >= NODELETS:
                raise CannotLoad(f"the limit is {NODELETS} nodelets; unload some, or use another manager")
            self._nodelets[name] = None
        try:
            made = class_of(plugin)
            log = ros_logger(f"ros.nodelet.{name}")
            node = HostedNode(self._host, name, remappings=remappings, arguments=arguments, log=log)
            try:
                nodelet = made(node)
            except BaseException:
                node.shutdown("it failed to start")
                raise
        except CannotLoad:
            self._forget(name)
            raise
        except Exception as error:
            self._forget(name)
            raise CannotLoad(f"{plugin} failed to start: {error}") from error
        close = getattr(nodelet, "close", None)
        if close is not None:
            node.on_shutdown(close)
        with self._lock:
            self._nodelets[name], self._types[name] = node, plugin
        if self._host.is_ending:
            node.shutdown("its host ends")

    def unload(self, name: str) -> bool:
        """Stop a nodelet. Return False if no nodelet has this full name."""
        with self._lock:
            node = self._nodelets.get(name)
            if node is None:
                return False
            del self._nodelets[name]
            del self._types[name]
        node.shutdown("it is unloaded")
        return True

    def _forget(self, name: str) -> None:
        with self._lock:
            del self._nodelets[name]


def class_of(plugin: str) -> Any:
    """Import and return the class of a nodelet.

    Raises:
        CannotLoad: the plugin has no Python class, or its module cannot be imported.
    """
    target = python_nodelet(plugin)
    if target is None:
        raise CannotLoad(why_no_nodelet(plugin))
    module, _, name = target.partition(":")
    try:
        return getattr(import_module(module), name)
    except PiprosError as error:  # an extra is missing; the message names it
        raise CannotLoad(str(error)) from error
    except (ImportError, AttributeError) as error:
        raise CannotLoad(f"the class {target} of {plugin} cannot be imported: {error}") from error


SAMPLES: Final = 12
"""Number of samples over which rates are measured. Warnings are logged once per this many samples."""

PERIOD_S: Final = 5.0
"""Interval between samples."""


@dataclass(frozen=True, slots=True)
class InputState:
    """Statistics of a nodelet's input topic over the last minute.

    Attributes:
        rate_hz: messages per second, including dropped messages.
        received: number of messages, including dropped messages.
        dropped: number of messages that were dropped because the nodelet was too slow.
    """

    nodelet: str
    topic: str
    rate_hz: float
    received: int
    dropped: int

    def __str__(self) -> str:
        return f"{self.topic} {self.rate_hz:.1f} Hz, {self.dropped} of {self.received} dropped"


class _Sample(NamedTuple):
    """Total numbers of messages and of dropped messages by nodelet and topic, at one time."""

    time_s: float
    totals: Mapping[tuple[str, str], tuple[int, int]]


class InputWatch:
    """Logs a warning every minute for each nodelet input that dropped messages in that minute."""

    def __init__(
        self, host: Node, nodelets: Callable[[], Iterable[tuple[HostedNode, str]]], period_s: float = PERIOD_S
    ) -> None:
        self._host = host
        self._nodelets = nodelets
        self._period_s = period_s
        self._samples = deque([self._sample()], maxlen=SAMPLES)
        threading.Thread(target=self._run, name=f"inputs of {host.name}", daemon=True).start()

    def _run(self) -> None:
        count = 0
        while not self._host.wait_for_shutdown(self._period_s):
            count += 1
            if count % SAMPLES == 0:
                for state in self.states():
                    if state.dropped:
                        self._host.log.warning(
                            "nodelet %s is slower than its input: %s", state.nodelet, state
                        )
            self._samples.append(self._sample())

    def states(self) -> list[InputState]:
        """Return the state of each input over the last minute, or since the nodelet subscribed to it."""
        now, before = self._sample(), list(self._samples)
        states = []
        for key, (received, dropped) in now.totals.items():
            # Count from the last sample without the topic, or from the oldest sample.
            since = next((each for each in reversed(before) if key not in each.totals), before[0])
            old_received, old_dropped = since.totals.get(key, (0, 0))
            if received < old_received:  # the nodelet has subscribed again
                old_received = old_dropped = 0
            count = received - old_received
            rate_hz = count / max(now.time_s - since.time_s, 1e-3)
            states.append(InputState(*key, rate_hz, count, dropped - old_dropped))
        return states

    def _sample(self) -> _Sample:
        totals = {}
        for node, _ in self._nodelets():
            for each in node.subscribers:
                statistics = each.statistics()
                dropped = statistics["dropped"]
                totals[node.name, each.topic] = (statistics["frames"] + dropped, dropped)
        return _Sample(time.monotonic(), totals)
