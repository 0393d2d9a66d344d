"""What a launcher tells about one of its processes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class ProcessReport:
    """One process of a launch at one moment; the newest one, when it was started again.

    Attributes:
        name: how it is called in messages: `talker-2`.
        exit_code: negative for the signal that ended it; None while it runs.
        spawn_count: how often it was started.
        environment: the variables that were laid over those of the launcher.
    """

    name: str
    package: str
    pid: int
    exit_code: int | None
    spawn_count: int
    arguments: tuple[str, ...]
    environment: Mapping[str, str]
    respawn: bool = False
    respawn_delay_s: float = 0.0
    required: bool = False
    has_log: bool = True

    @property
    def is_alive(self) -> bool:
        return self.exit_code is None

    def as_struct(self) -> dict[str, Any]:
        """The same under the names that Noetic's `process_info` has."""
        struct = {
            "name": self.name,
            "package": self.package,
            "pid": self.pid,
            "alive": self.is_alive,
            "spawn_count": self.spawn_count,
            "args": list(self.arguments),
            "env": dict(self.environment),
            "respawn": self.respawn,
            "respawn_delay": self.respawn_delay_s,
            "required": self.required,
            "log_output": self.has_log,
        }
        return struct if self.exit_code is None else {**struct, "exit_code": self.exit_code}
