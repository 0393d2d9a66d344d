"""The test nodes of rostest have the same parameters, cases and exit codes as the genuine ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.rostest_nodes import SCENES, LevelSystem, Scene, cases_in

GENUINE_NODES = Path("/usr/share/rostest/nodes")


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory, bare_tools: Path) -> Iterator[LevelSystem]:
    port = ClaimedPort()
    ros = RosSystem(port.number, tmp_path_factory.mktemp("level"), bare_tools)
    system = LevelSystem(ros, ros.genuine, "/usr/bin/python3", GENUINE_NODES)
    yield system
    system.close()
    ros.close()
    port.release()


@pytest.mark.parametrize("scene", SCENES, ids=[f"{scene.node} {scene.params}" for scene in SCENES])
def test_a_genuine_test_node_ends_as_ours_does(system: LevelSystem, scene: Scene) -> None:
    """tests/graph/test_rostest_nodes.py tests our outcomes with the same scenes."""
    ended, cases = system.run(scene, f"scene_{SCENES.index(scene)}")

    assert ended.returncode == (0 if scene.passes else 1), ended.output
    assert cases == scene.cases


@pytest.mark.parametrize("scene", [SCENES[0], SCENES[-1]], ids=["passes", "fails"])
def test_a_genuine_rostest_runs_them_as_ours_does(ros: RosSystem, scene: Scene) -> None:
    scene.write(ros.home / "ws")
    ros.genuine.environment["ROS_PACKAGE_PATH"] = f"{ros.home / 'ws'}:/usr/share"

    ran = ros.genuine.run("rostest", "around", "scene.test", timeout_s=120)

    assert ran.returncode == (0 if scene.passes else 2), ran.output
    assert scene.cases == cases_in(ros.home / ".ros/test_results/around/rosunit-scene.xml")


def test_each_genuine_test_node_has_its_counterpart() -> None:
    import pipros

    ours = {file.name for file in (Path(pipros.__file__).parent / "share/rostest/nodes").iterdir()}

    assert {file.name for file in GENUINE_NODES.iterdir()} <= ours
