"""The commands of docs/ci.md, run in a repository with a package, and the coverage of its node."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

from tests.support.environments import REPOSITORY

TEXT = (REPOSITORY / "docs" / "ci.md").read_text()
GITHUB, GITLAB = (yaml.safe_load(block) for block in re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL))
VERSIONS = ["3.10", "3.11", "3.12", "3.13", "3.14"]

NODE = """#!/usr/bin/env python3
import rospy
rospy.init_node("level")
rospy.set_param("/level", 25)
rospy.spin()
"""
TEST = """#!/usr/bin/env python3
import sys, time, unittest
import rospy, rostest

class Level(unittest.TestCase):
    def test_level(self):
        while not rospy.has_param("/level"):
            time.sleep(0.01)
        self.assertEqual(rospy.get_param("/level"), 25)

    def test_nothing(self):
        pass

rostest.rosrun("robot", "level", Level, sys.argv)
"""
LAUNCH = """<launch>
  <node name="level" pkg="robot" type="level.py"/>
  <test test-name="first" pkg="robot" type="check_level.py"/>
</launch>"""


def steps_of_github() -> list[str]:
    return [step["run"] for step in GITHUB["jobs"]["test"]["steps"] if "run" in step]


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """Return a repository with a package, and the settings of coverage in the page."""
    package = tmp_path / "src" / "robot"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robot</name></package>")
    for name, content in {"level.py": NODE, "check_level.py": TEST, "level.test": LAUNCH}.items():
        (package / name).write_text(content)
        (package / name).chmod(0o755)
    settings = re.findall(r"```ini\n(.*?)```", TEXT, re.DOTALL)[0]
    (tmp_path / ".coveragerc").write_text(settings)
    return tmp_path


@pytest.mark.timeout(300)
@pytest.mark.parametrize("steps", [steps_of_github(), GITLAB["test"]["script"]], ids=["GitHub", "GitLab"])
def test_the_steps_of_the_jobs_run(repository: Path, steps: list[str]) -> None:
    environment = {
        **{name: value for name, value in os.environ.items() if not name.startswith(("COV", "PYTEST"))},
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PIPROS": "",  # it is installed already
        "ROS_HOME": str(repository / ".ros"),
    }
    for step in steps:
        done = subprocess.run(
            ["bash", "-e", "-c", step],
            cwd=repository,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert done.returncode == 0, f"{step}\n{done.stdout}"
    results = ElementTree.parse(repository / "results.xml").getroot()  # noqa: S314
    assert [case.get("name") for case in results.iter("testcase")] == ["test_level", "test_nothing"]
    covered = ElementTree.parse(repository / "coverage.xml").getroot()  # noqa: S314
    rates = {file.get("filename"): file.get("line-rate") for file in covered.iter("class")}
    assert rates["robot/level.py"] == "1"


@pytest.mark.parametrize(
    "versions",
    [
        GITHUB["jobs"]["test"]["strategy"]["matrix"]["python"],
        GITLAB["test"]["parallel"]["matrix"][0]["PYTHON"],
    ],
    ids=["GitHub", "GitLab"],
)
def test_the_jobs_use_all_supported_versions_of_python(versions: Any) -> None:
    classifiers = re.findall(
        r'"Programming Language :: Python :: (3\.\d+)"', (REPOSITORY / "pyproject.toml").read_text()
    )
    assert versions == classifiers == VERSIONS
