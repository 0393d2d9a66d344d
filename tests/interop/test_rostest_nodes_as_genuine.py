"""The test nodes of rostest beside genuine ones: same parameters, same cases, same exit codes."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support.ros import RosSystem, Side
from tests.support.rostest_nodes import SCENES, Scene

GENUINE_NODES = Path("/usr/share/rostest/nodes")


def run(side: Side, scene: Scene, workspace: Path) -> tuple[int | None, list[tuple[str, str, bool]]]:
    """The exit code, and the cases of the result file with whether they passed."""
    results = side.home / f"results_{id(side)}"
    path = f"{workspace}:{side.environment['ROS_PACKAGE_PATH']}"
    ran = side.run(
        "rostest", "around", "scene.test", ROS_PACKAGE_PATH=path, ROS_TEST_RESULTS_DIR=str(results)
    )
    suite = ElementTree.parse(results / "around/rosunit-scene.xml").getroot()  # noqa: S314
    return ran.returncode, [
        (case.attrib["classname"], case.attrib["name"], len(case) == 0) for case in suite.iter("testcase")
    ]


@pytest.mark.parametrize("scene", SCENES, ids=[f"{scene.node} {scene.params}" for scene in SCENES])
def test_a_test_node_ends_as_its_genuine_original_does(ros: RosSystem, scene: Scene) -> None:
    scene.write(ros.home / "ws")

    ours = run(ros.pipros, scene, ros.home / "ws")
    theirs = run(ros.genuine, scene, ros.home / "ws")

    assert ours == theirs


def test_each_genuine_test_node_has_its_counterpart() -> None:
    import pipros

    ours = {file.name for file in (Path(pipros.__file__).parent / "share/rostest/nodes").iterdir()}

    assert {file.name for file in GENUINE_NODES.iterdir()} <= ours
