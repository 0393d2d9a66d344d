"""The settings that all clients of a rosbridge server share."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipros_bridges.rosbridge.authentication import Authenticator
from pipros_bridges.rosbridge.globs import Globs
from pipros_server.policy.model import Policy


@dataclass(frozen=True, slots=True)
class RosbridgeSettings:
    """Settings for all clients of a server.

    Attributes:
        topics, services: names that clients may use. rosapi checks the names of parameters.
        authenticator: checks `auth`, which must be the first operation; None to disable authentication.
        has_control: whether clients may publish, call services and offer services. If False, they may
            call only those services of `rosapi` that do not change the system.
        is_bson: whether binary frames are BSON.
        fragment_timeout_s: how long the fragments of an incomplete text are kept.
        policy: restricts what clients may do; None for no policy.
    """

    topics: Globs = field(default_factory=Globs)
    services: Globs = field(default_factory=Globs)
    authenticator: Authenticator | None = None
    has_control: bool = True
    is_bson: bool = False
    fragment_timeout_s: float = 600.0
    policy: Policy | None = None
