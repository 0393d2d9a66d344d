"""The test nodes of rostest beside genuine ones: same parameters, same cases, same exit codes."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support.ros import RosSystem
from tests.support.rostest_nodes import SCENES, Scene

GENUINE_NODES = Path("/usr/share/rostest/nodes")


@pytest.mark.parametrize("scene", SCENES, ids=[f"{scene.node} {scene.params}" for scene in SCENES])
def test_a_genuine_test_node_ends_as_ours_does(ros: RosSystem, scene: Scene) -> None:
    """That ours ends this way is tested by tests/graph/test_rostest_nodes.py, with the same scenes."""
    scene.write(ros.home / "ws")
    ros.genuine.environment["ROS_PACKAGE_PATH"] = f"{ros.home / 'ws'}:/usr/share"

    ran = ros.genuine.run("rostest", "around", "scene.test", timeout_s=50)

    assert ran.returncode == (0 if scene.passes else 2), ran.output
    results = ElementTree.parse(ros.home / ".ros/test_results/around/rosunit-scene.xml").getroot()  # noqa: S314
    assert scene.cases == tuple(
        (case.attrib["classname"], case.attrib["name"], len(case) == 0) for case in results.iter("testcase")
    )


def test_each_genuine_test_node_has_its_counterpart() -> None:
    import pipros

    ours = {file.name for file in (Path(pipros.__file__).parent / "share/rostest/nodes").iterdir()}

    assert {file.name for file in GENUINE_NODES.iterdir()} <= ours
