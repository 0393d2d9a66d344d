"""The files that a robot description names, and only these, can be read."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros_page.views.scene import SceneViews
from pipros_page.views.scene_robots import DESCRIPTIONS
from pipros_server.view_server import RequestRefused


def description(mesh: Path) -> str:
    geometry = f'<geometry><mesh filename="file://{mesh}"/></geometry>'
    return f'<robot name="r"><link name="base"><visual>{geometry}</visual></link></robot>'


class System:
    """Stands for a watched system: parameters with robot descriptions."""

    def __init__(self) -> None:
        self.node = SimpleNamespace(environment=Environment(master_uri="http://localhost:1"))
        self.questions = self.computations = self
        self.texts: dict[str, str] = {}

    async def run(self, function: Callable[..., Any], *args: Any) -> Any:
        return self.texts[args[0]] if args[0] in self.texts and len(args) == 1 else function(*args)


def test_the_files_of_an_old_description_can_no_longer_be_read(tmp_path: Path) -> None:
    old, new, other = (tmp_path / name for name in ("a/old.stl", "b/new.stl", "c/other.stl"))
    for file in (old, new, other):
        file.parent.mkdir()
        file.write_bytes(file.name.encode())
    system: Any = System()
    views = SceneViews(system)

    async def show(name: str, mesh: Path) -> None:
        system.texts[name] = description(mesh)
        async for shown in views.robot({"name": name}):
            assert "links" in shown

    async def read(file: Path) -> bytes:
        return b"".join([data async for data in views.resource({"uri": f"file://{file}"})])

    async def body() -> None:
        await show("robot_description", old)
        await show("other_description", other)
        assert await read(old) == b"old.stl"
        await show("robot_description", new)
        assert await read(new) == b"new.stl"
        assert await read(other) == b"other.stl"
        with pytest.raises(RequestRefused):
            await read(old)
        for number in range(DESCRIPTIONS):
            await show(f"robot{number}", old)
        with pytest.raises(RequestRefused):
            await read(new)

    asyncio.run(body())
