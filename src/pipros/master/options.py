"""The settings of a master as one value, which launcher, core and master pass on whole."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict

from pipros.env import DEFAULT_MASTER_PORT
from pipros.limits import Limits, process_limits


@dataclass(frozen=True, slots=True)
class Probing:
    """When nodes are probed.

    Attributes:
        round_s: how often every node is probed, as long as that is not too often for the master.
        newcomers_s: how soon a node is probed for the first time.
        answer_s: how long a node may take to answer.
        confirmation_pause_s: the time between two probes of a suspect.
    """

    round_s: float = 3.0
    newcomers_s: float = 0.3
    answer_s: float = 3.0
    confirmation_pause_s: float = 0.5


@dataclass(frozen=True, slots=True)
class MasterOptions:
    """How a master is set up.

    Attributes:
        host: the address to listen on; by default the environment decides: loopback as long as everything is
            local (see `pipros.net.address`).
        port: the port; 0 takes a free one.
        advertised_host: the host in the URI of the master; by default the environment decides.
        known_as: host names and addresses by which programs on this machine look for the master, besides the
            one in the environment's master URI. While it is for this machine only, it listens there, too.
        allow: networks that may connect, besides this machine: `10.0.0.0/8`, `192.168.1.7`. Empty for all.
        parameters: keys and values to set before the port is opened.
        limits: what peers may cost; by default the limits of the process.
        store: a file that keeps parameters and registrations, and from which they are restored on start.
        log_level: one of `pipros.master.log.LEVELS`, for the log file that `Core` writes.
        on_shutdown: called, in the master's thread, when a peer on this machine calls `shutdown`; the owner
            then calls `stop()`.
        probing: when nodes are asked whether they are still there.
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
    """The limits of the process with `notice_s` as the `-t` of roscore and rosmaster sets it.

    As in Noetic, a timeout that is not a positive number leaves the default.
    """
    limits = process_limits()
    if timeout_s is None or math.isnan(timeout_s) or timeout_s <= 0:
        return limits
    return limits._replace(notice_s=timeout_s)
