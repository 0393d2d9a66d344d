"""A master's settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, TypedDict

from pipros.basics.env import DEFAULT_MASTER_PORT
from pipros.basics.limits import Limits, process_limits


class Probing(NamedTuple):
    """Intervals and timeouts for probing nodes.

    Attributes:
        round_s: the interval between probes of the same node; longer if there are very many nodes, and ten
            times as long if the node keeps asking the master.
        newcomers_s: the maximum delay before a new node is first probed, unless the master is busy.
        answer_s: the timeout of a probe.
        confirmation_pause_s: the time between probes that confirm that a node has ended.
        resume_s: how long nodes from a previous run may take to respond.
    """

    round_s: float = 3.0
    newcomers_s: float = 0.3
    answer_s: float = 3.0
    confirmation_pause_s: float = 0.5
    resume_s: float = 1.0


@dataclass(frozen=True, slots=True)
class MasterOptions:
    """The settings of a master.

    Attributes:
        host: the address to listen on. By default, the environment determines it; see `pipros.net.address`.
        port: the port; 0 selects a free port.
        advertised_host: the host in the master's URI; by default taken from the environment.
        known_as: host names and addresses under which programs on this machine look for the master, in
            addition to the host in the environment's master URI. A master that is reachable only from this
            machine also listens on these addresses.
        allow: networks and addresses, such as `10.0.0.0/8`, that may connect in addition to this machine.
            If empty, all may connect.
        parameters: keys and values to set before the port is opened.
        limits: limits on the resources that peers can use; defaults to the process-wide limits.
        store: the file in which parameters and registrations are stored, to be restored on the next start.
        log_level: one of `pipros.master.log.LEVELS`, for the log file that `Core` writes.
        on_shutdown: called with the reason, in the master's thread, when a peer on this machine calls
            `shutdown`; the owner must then call `stop()`. If None, `shutdown` is refused.
        probing: intervals and timeouts for probing nodes.
    """

    host: str | None = None
    port: int = DEFAULT_MASTER_PORT
    advertised_host: str | None = None
    known_as: Sequence[str] = ()
    allow: Sequence[str] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    limits: Limits | None = None
    store: Path | None = None
    log_level: str | None = None
    on_shutdown: Callable[[str], None] | None = None
    probing: Probing = field(default_factory=Probing)


class MasterSettings(TypedDict, total=False):
    """The fields of `MasterOptions` as keyword arguments."""

    host: str | None
    port: int
    advertised_host: str | None
    known_as: Sequence[str]
    allow: Sequence[str]
    parameters: Mapping[str, Any]
    limits: Limits | None
    store: Path | None
    log_level: str | None
    on_shutdown: Callable[[str], None] | None
    probing: Probing


def limits_with_timeout(timeout_s: float | None) -> Limits:
    """Return the process-wide limits with `notice_s` set from the `-t` option of roscore and rosmaster.

    As in Noetic, a timeout that is not a positive number has no effect.
    """
    limits = process_limits()
    if timeout_s is None or math.isnan(timeout_s) or timeout_s <= 0:
        return limits
    return limits._replace(notice_s=timeout_s)
