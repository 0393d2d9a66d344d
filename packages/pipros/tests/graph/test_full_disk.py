"""On a full disk, commands keep the old file, name the new one, leave no part of it, and exit with 1."""

from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import String

import rosbag
from tests.support.ros import RosSystem

pytestmark = pytest.mark.needs("resource limits")

MANIFEST = """<package format="2"><name>pk</name><version>0.0.1</version><description>x</description>
<maintainer email="a@example.org">x</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend></package>"""
CALIBRATION = """{image_width: 4, image_height: 4, camera_name: c,
camera_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}, distortion_model: plumb_bob,
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]},
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]},
projection_matrix: {rows: 3, cols: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]}}"""
MAP = "{info: {resolution: 1, width: 1, height: 1, origin: {orientation: {w: 1}}}, data: [0]}"
INPUT = {
    "robot.urdf": "<robot name='r'><link name='a'/></robot>",
    "dump.launch": "<launch><rosparam command='dump' file='$(dirname)/out.yaml'/></launch>",
    "pk/package.xml": MANIFEST,
    "pk/CMakeLists.txt": "cmake_minimum_required(VERSION 3.0)\nproject(pk)\nfind_package(catkin REQUIRED)\n"
    "catkin_package()\n",
    "pk/a.launch": "<launch/>", "cal.yaml": CALIBRATION, "rows.csv": "a,b\n1,2\n",
    "node.py": "import rospy\nrospy.init_node('x')\n",
}  # fmt: skip
COMMANDS = {
    "catkin_create_pkg new rospy": ["new"], "urdf_to_graphviz robot.urdf robot": ["robot.gv", "robot.pdf"],
    "rosparam dump out.yaml": ["out.yaml"], "roslaunch dump.launch": ["out.yaml"],
    "roslaunch-check -o result.xml pk/a.launch": ["result.xml"],
    "rosrun tf view_frames": ["frames.gv", "frames.svg", "frames.pdf"],
    "rosrun camera_calibration_parsers convert cal.yaml cal.ini": ["cal.ini"],
    "rosrun map_server map_saver -f map": ["map.yaml", "map.pgm"],
    "rosrun diagnostic_analysis sparse_csv.py rows.csv": ["rows_sparse.csv"],
    "rosrun diagnostic_analysis export_csv.py some.bag -d .": ["some_csv/n.csv"],
    "rosrun rosunit check_test_ran.py result.xml": ["result.xml"],
    "pipros port --write out node.py": ["out/node.py"], "pipros stubs -o stubs std_msgs": ["stubs/std_msgs"],
    "pipros wheel --init pk": ["pk/pyproject.toml"], "pipros wheel -o . pk": ["pk-0.0.1-py3-none-any.whl"],
    "rqt_graph --svg=graph.svg": ["graph.svg"], "rosbag filter some.bag new.bag True": ["new.bag"],
    "rosbag convert -f some.bag new.mcap": ["new.mcap"],
    "rosbag merge -f some.bag some.bag -o new.bag": ["new.bag"],
    "rosbag split some.bag --every 1s": ["some_"], "rosbag export some.bag . /t": ["t.csv"],
    "rosbag table some.bag /t -o new.csv": ["new.csv"],
    "rosbag record -O new.bag --duration 1 /rosout": ["new.bag"],
}  # fmt: skip
"""Commands, and the files of which one is named. Those that were there before stay."""

NEW = (
    "catkin_create_pkg", "pipros port", "roslaunch-check", "rosrun rosunit", "rosbag split", "pipros stubs",
    "rosrun diagnostic_analysis export",
)  # fmt: skip
"""Commands that write no file that exists, or remove it first."""


@pytest.fixture
def folder(ros: RosSystem) -> Path:
    folder = ros.home / "work"
    for name, text in INPUT.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    with rosbag.Bag(folder / "some.bag", "w") as bag:
        bag.write("/t", String("x"))
        bag.write("/diagnostics", DiagnosticArray(status=[DiagnosticStatus(name="n")]))
    ros.pipros.environment["ROS_PACKAGE_PATH"] += f":{folder}"
    ros.serve_master()
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    files = (file for file in folder.rglob("*") if file.is_file())
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_old_file_is_kept_and_the_new_one_named(command: str, ros: RosSystem, folder: Path) -> None:
    for name in () if command.startswith(NEW) else COMMANDS[command]:
        (folder / name).write_text("#" * 600)
    if "map_saver" in command:
        ros.pipros.start("rostopic", "pub", "-l", "/map", "nav_msgs/OccupancyGrid", MAP)
    before = contents(folder)

    blocks = int("wheel" in command)  # it needs a folder for temporary files
    limited = f'cd work && ulimit -f {blocks} && exec "$@"'
    ended = ros.pipros.run("sh", "-c", limited, "sh", *command.split(), PYTHONDONTWRITEBYTECODE="1")

    assert ended.returncode == (255 if "calibration" in command or "urdf" in command else 1), ended.output
    assert any(name in ended.output for name in COMMANDS[command])
    assert "File too large" in ended.output
    assert "Traceback" not in ended.output
    assert contents(folder) == before
