"""A layer of an installed package: the example in docs/guides/navigation.md, loaded by its entry point."""

from __future__ import annotations

import logging
import re
import sys
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipros.basics.errors import NotFound
from pipros_libraries.nodes.params import PrivateParameters
from pipros_robot.navigation.costmap import layers
from pipros_robot.navigation.costmap.layered import LayeredCostmap, Pose2D
from tests.support.environments import REPOSITORY

KIND = "my_robot::KeepOut"


class Params:
    """A parameter server with the parameters of one layer."""

    def get(self, name: str) -> Any:
        if name == "~costmap/stairs":
            return {"area": [0.25, 0.25, 0.65, 0.45]}
        raise NotFound(name)


def costmap_with(entries: list[dict[str, str]]) -> Any:
    layered = LayeredCostmap()
    layered.resize(10, 10, 0.1, 0.0, 0.0)
    node = SimpleNamespace(params=Params())
    return SimpleNamespace(
        node=node, log=logging.getLogger("costmap"), namespace="~costmap", layered=layered,
        given=PrivateParameters({"plugins": entries}),
    )  # fmt: skip


@pytest.fixture
def point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (REPOSITORY / "plugins" / "pipros-robot" / "docs" / "guides" / "navigation.md").read_text(
        encoding="utf-8"
    )
    section = text.partition("## Your own costmap layer")[2]
    code = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    declared = re.search(r'```toml\n.*entry-points."(.+)"]\n"(.+)" = "[\w.]+:(\w+)"\n```', section)
    assert code is not None
    assert declared is not None
    group, kind, name = declared.groups()
    (tmp_path / "keep_out_example.py").write_text(code[1], encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "keep_out_example", raising=False)
    points = {
        kind: EntryPoint(kind, f"keep_out_example:{name}", group),
        "bad::Layer": EntryPoint("bad::Layer", "no_such_module:Layer", layers.ENTRY_POINTS),
    }
    monkeypatch.setattr(
        layers, "entry_points", lambda **wanted: EntryPoints(points.values()).select(**wanted)
    )


@pytest.mark.usefixtures("point")
def test_the_documented_layer_marks_its_area() -> None:
    costmap = costmap_with([{"name": "stairs", "type": KIND}])
    assert layers.add_layers(costmap) == []
    costmap.layered.update(Pose2D(0.0, 0.0, 0.0))
    expected = np.zeros((10, 10), np.uint8)
    expected[2:5, 2:7] = 254
    assert np.array_equal(costmap.layered.grid.costs, expected)


@pytest.mark.usefixtures("point")
def test_a_layer_that_cannot_be_imported_is_left_out(caplog: pytest.LogCaptureFixture) -> None:
    costmap = costmap_with([{"name": "a", "type": "bad::Layer"}, {"name": "stairs", "type": KIND}])
    layers.add_layers(costmap)
    assert [each.name for each in costmap.layered.layers] == ["stairs"]
    assert "a: bad::Layer cannot be imported: ModuleNotFoundError" in caplog.text


def test_an_unknown_layer_with_sources_runs_as_a_voxel_or_obstacle_layer(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    made = []
    monkeypatch.setattr(
        layers,
        "LAYERS",
        {
            kind: lambda costmap, name, kind: (
                made.append((name, kind)) or costmap.layered.layers.append(name) or [name]
            )
            for kind in layers.LAYERS
        },
    )
    values = {
        "~costmap/cliff": {"observation_sources": "scan"},
        "~costmap/depth": {"observation_sources": "scan", "z_voxels": 4},
    }
    entries = [{"name": name, "type": f"fetch::{name}"} for name in ("cliff", "depth")]
    costmap = costmap_with(entries)
    costmap.node.params = SimpleNamespace(get=lambda name: values.get(name, {}))

    layers.add_layers(costmap)

    assert made == [("cliff", layers.OBSTACLE), ("depth", layers.VOXEL)]
    assert "fetch::cliff" in caplog.text
    assert costmap.blind_without == []


@pytest.mark.usefixtures("point")
@pytest.mark.parametrize(("others", "blind"), [([], ["a"]), ([{"name": "stairs", "type": KIND}], [])])
def test_a_costmap_without_any_sensor_names_the_layers_that_are_missing(
    others: list[dict[str, str]], blind: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def inflate(costmap: Any, name: str, _: str) -> list[Any]:
        costmap.layered.layers.append(SimpleNamespace(name=name))
        return []

    monkeypatch.setattr(layers, "LAYERS", {layers.INFLATION: inflate})
    inflation = {"name": "inflation", "type": layers.INFLATION}
    costmap = costmap_with([{"name": "a", "type": "bad::Layer"}, inflation, *others])

    layers.add_layers(costmap)

    assert costmap.blind_without == blind
