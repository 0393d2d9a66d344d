"""Bags as tables: columns of numpy arrays, decoded in bulk. Needs the extra `data`.

    from pipros.data import open_bags

    with open_bags("run*.bag") as bags:
        imu = bags.table("/imu")
        imu["linear_acceleration.x"]

Definitions become plans (`plans.py`), which positions in joined messages follow (`cursors.py`, `decode.py`).
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from pipros.data.bags import Bags, open_bags
    from pipros.data.columns import Column, ListColumn, OctetColumn, RecordColumn, TextColumn
    from pipros.data.live.commands import ActionRefused
    from pipros.data.live.environment import RobotEnvironment
    from pipros.data.live.robot import LiveRobot
    from pipros.data.live.sources import RobotSilent
    from pipros.data.live.teleoperator import LiveTeleoperator
    from pipros.data.table import Table

__all__ = [
    "ActionRefused",
    "Bags",
    "Column",
    "ListColumn",
    "LiveRobot",
    "LiveTeleoperator",
    "OctetColumn",
    "RecordColumn",
    "RobotEnvironment",
    "RobotSilent",
    "Table",
    "TextColumn",
    "open_bags",
]

_HOMES = {"Bags": "bags", "Table": "table", "open_bags": "bags", "RobotEnvironment": "live.environment"}
_HOMES |= {"ActionRefused": "live.commands", "LiveRobot": "live.robot", "RobotSilent": "live.sources"}
_HOMES["LiveTeleoperator"] = "live.teleoperator"
_HOMES |= dict.fromkeys(("Column", "ListColumn", "OctetColumn", "RecordColumn", "TextColumn"), "columns")


def __getattr__(name: str) -> Any:
    """Import a name when it is used, since the declaration of the room is imported by all commands."""
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from importlib import import_module

    try:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    except ImportError as error:
        from pipros.basics.errors import MissingExtra
        from pipros.data.extras import missing_extra

        if isinstance(error, MissingExtra):
            raise

        raise missing_extra(error, __name__) from error
