"""What genuine ROS made and pipros meets: generated packages, and pickles, in both directions."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.interop.programs.examine_messages import ask, ask_genuine
from tests.interop.test_messages_against_genuine import installed_types
from tests.support.catkin import CatkinWorkspace

GENERATED = Path("/usr/lib/python3/dist-packages")
PACKAGES = ["actionlib_msgs", "diagnostic_msgs", "geometry_msgs", "nav_msgs", "rosgraph_msgs", "sensor_msgs"]
PACKAGES += ["std_msgs", "std_srvs"]
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}


@pytest.fixture
def generated(tmp_path: Path) -> Path:
    """A folder with packages that genpy generated, as a devel space has them, and no genpy."""
    for package in PACKAGES:
        (tmp_path / package).symlink_to(GENERATED / package)
    return tmp_path


def test_packages_that_genpy_generated_run_on_pipros(generated: Path) -> None:
    jobs = [job for job in installed_types() if job["type"].partition("/")[0] in PACKAGES]

    found = ask([sys.executable], jobs, {**ENVIRONMENT, "PYTHONPATH": str(generated)})

    assert len(jobs) > 100
    for job, ours, genuine in zip(jobs, found, ask_genuine(jobs), strict=True):
        assert ours == genuine, job["type"]


def test_a_definition_may_embed_what_genpy_generated(generated: Path, tmp_path: Path) -> None:
    package = tmp_path / "src" / "robot"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robot</name></package>")
    (package / "msg" / "Goal.msg").write_text("geometry_msgs/PoseStamped pose\nstd_msgs/String[] names")
    code = """
import geometry_msgs, std_msgs.msg
from robot.msg import Goal
assert "generated" not in Goal.__module__ and hasattr(geometry_msgs, "__file__")
goal = Goal(names=[std_msgs.msg.String("a")])
print(Goal._from_bytes(b"".join(goal._to_buffers())) == goal, type(goal.pose).__mro__[1].__name__)
"""
    environment = {**ENVIRONMENT, "PYTHONPATH": str(generated), "ROS_PACKAGE_PATH": str(package.parent)}
    assert shown([sys.executable], code, environment) == "True Message"


def test_a_devel_space_of_genuine_catkin_serves_pipros(catkin_workspace: CatkinWorkspace) -> None:
    generated = catkin_workspace.folder / "devel" / "lib" / "python3" / "dist-packages"
    code = """
from composiv_tryouts.msg import BatteryLevel
from pipros.msg import load_message_class
print(BatteryLevel.__base__.__name__, load_message_class("composiv_tryouts/BatteryLevel") is BatteryLevel)
print(__import__("composiv_tryouts").__file__, BatteryLevel._from_bytes(BatteryLevel("25")._to_buffers()[0]))
"""
    said = shown([sys.executable], code, {**ENVIRONMENT, "PYTHONPATH": str(generated)})
    assert said.splitlines() == [
        "Message True",
        f'{generated}/composiv_tryouts/__init__.py battery: "25"',
    ]


MAKE = """
import genpy, pickle, sys
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Header
message = PoseStamped(header=Header(3, genpy.Time(1, 2), "map"))
print(pickle.dumps([message, genpy.Time(4), genpy.Duration(-5)]).hex())
"""
SHOW = "import pickle; print(pickle.loads(bytes.fromhex('{}')))"


@pytest.mark.parametrize("is_from_genuine", [True, False])
def test_pickles_are_loaded_in_other_processes(is_from_genuine: bool) -> None:
    sides = [(["/usr/bin/python3"], {"PATH": "/usr/bin:/bin"}), ([sys.executable], ENVIRONMENT)]
    maker, reader = sides if is_from_genuine else sides[::-1]

    pickled = shown(*maker[:1], MAKE, maker[1])

    said = shown(*reader[:1], SHOW.format(pickled), reader[1])
    assert "seq: 3" in said
    assert said.endswith("genpy.Time[4000000000], genpy.Duration[-5000000000]]")


def shown(command: list[str], code: str, environment: dict[str, str]) -> str:
    result = subprocess.run([*command, "-c", code], env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()
