"""The fixture `navigation_world`, which pipros's plugin of pytest finds through `pipros.basics.plugins`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:
    from pipros_robot.navigation.plane import Triple
    from pipros_robot.navigation.world import NavigationWorld
    from pipros_tools.launch.roscore import Core


class MakeWorld(Protocol):
    """The type of `navigation_world`."""

    def __call__(self, map_file: str | Path, start: Triple, **options: Any) -> NavigationWorld: ...


@pytest.fixture
def navigation_world(ros_master: Core, request: pytest.FixtureRequest) -> Iterator[MakeWorld]:
    """Start a simulated robot with amcl and move_base: `navigation_world("flat.yaml", (1.0, 2.0, 0.0))`.

    The path of the map is relative to the test module's folder; `"apartment"` and `"room"` are maps in
    pipros_sim. `start` is the robot's initial (x, y, yaw). `NavigationWorld` describes the options. The nodes
    run in this process, in lockstep. After the test, the ratio of simulated to real time is printed.
    """
    from pipros_robot.navigation.world import NavigationWorld
    from pipros_workspace.index import SHARED_PACKAGES

    worlds: list[NavigationWorld] = []

    def make(map_file: str | Path, start: Triple, **options: Any) -> NavigationWorld:
        file = request.path.parent / map_file
        known = SHARED_PACKAGES / "pipros_sim" / "maps" / f"{map_file}.yaml"
        if not file.exists() and known.exists():
            file = known
        worlds.append(NavigationWorld(ros_master.uri, str(file), start=start, **options))
        return worlds[-1]

    try:
        yield make
    finally:
        for world in worlds:
            world.close()
            print(world.report)
