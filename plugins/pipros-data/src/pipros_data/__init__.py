"""Bags as tables: columns of numpy arrays, decoded in bulk. The package needs the extra `data`.

    from pipros_data import open_bags

    with open_bags("run*.bag") as bags:
        imu = bags.table("/imu")
        imu["linear_acceleration.x"]

`pipros.msg.bulk` decodes messages; the modules here read bags, join tables, and write files and data sets.
`live` connects a policy to a robot.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from pipros.msg.bulk.columns import Column, ListColumn, OctetColumn, RecordColumn, TextColumn
    from pipros_data.bags import Bags
    from pipros_data.live.commands import ActionRefused
    from pipros_data.live.environment import RobotEnvironment
    from pipros_data.live.robot import LiveRobot
    from pipros_data.live.sources import RobotSilent
    from pipros_data.live.teleoperator import LiveTeleoperator
    from pipros_data.opening import open_bags
    from pipros_data.table import Table

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

_HOMES = {
    "pipros_data.bags": "Bags",
    "pipros_data.opening": "open_bags",
    "pipros_data.live.commands": "ActionRefused",
    "pipros_data.live.environment": "RobotEnvironment",
    "pipros_data.live.robot": "LiveRobot",
    "pipros_data.live.sources": "RobotSilent",
    "pipros_data.live.teleoperator": "LiveTeleoperator",
    "pipros_data.table": "Table",
    "pipros.msg.bulk.columns": "Column ListColumn OctetColumn RecordColumn TextColumn",
}


def __getattr__(name: str) -> Any:
    """Import a name when it is first used, because each search for plugins imports this package."""
    home = next((home for home, names in _HOMES.items() if name in names.split()), None)
    if home is None:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from importlib import import_module

    try:
        return getattr(import_module(home), name)
    except ModuleNotFoundError as error:  # a MissingExtra already names the missing library
        from pipros_data.extras import missing_extra

        raise missing_extra(error, __name__) from error


def __dir__() -> list[str]:
    """Return the public names, which are imported when they are first used."""
    return sorted(__all__)
