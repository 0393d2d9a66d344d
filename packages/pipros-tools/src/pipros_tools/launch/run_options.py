"""Options for running a launch."""

from __future__ import annotations

from dataclasses import dataclass

from pipros_tools.launch.model import LaunchError, Output
from pipros_tools.launch.terminate import SIGINT_TIMEOUT_S, SIGTERM_TIMEOUT_S


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Options for running a launch.

    Attributes:
        output: the destination for the standard output of all nodes; None leaves the choice to each node.
        all_required: whether to stop the launch when any node exits.
        local_only: whether to skip nodes on other machines.
        has_prefixes: whether lines that nodes print on the terminal are prefixed with the node's name.
        is_child: whether this is a launch child, whose standard output is not shown.
    """

    output: Output | None = None
    all_required: bool = False
    local_only: bool = False
    has_prefixes: bool = False
    is_child: bool = False
    sigint_timeout_s: float = SIGINT_TIMEOUT_S
    sigterm_timeout_s: float = SIGTERM_TIMEOUT_S

    def __post_init__(self) -> None:
        for name, value in (
            ("sigint_timeout", self.sigint_timeout_s),
            ("sigterm_timeout", self.sigterm_timeout_s),
        ):
            if not value > 0:
                raise LaunchError(f"{name} must be a positive number, received {value:f}")
