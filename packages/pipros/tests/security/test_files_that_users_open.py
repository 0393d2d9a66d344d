"""Whatever a file that a user opens contains: an error that names the file, soon, with little memory."""

import json
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from std_msgs.msg import String

import rosbag
from pipros.master.master import Master
from tests.support.environments import VENV_BIN, source
from tests.support.unusable_files import CONTENTS, KINDS, faults, make_unusable, outcomes

MAP = "image: FILE\nresolution: 0.1\norigin: [0, 0, 0]\noccupied_thresh: 0.6\nfree_thresh: 0.2\nnegate: 0\n"
XACRO = "roslaunch --nodes FOLDER/xacro.launch file:=FILE"
SPARSE = "SHARE/diagnostic_analysis/scripts/sparse_csv.py FILE"
COMMANDS = {
    "rosparam load FILE": "yaml", "rosparam set -t FILE /p": "txt",
    "rostopic pub -1 -f FILE /t std_msgs/String": "yaml", "rostopic echo -b FILE /t": "bag",
    "roslaunch --nodes FILE": "launch", "roslaunch --nodes FOLDER/params.launch file:=FILE": "yaml",
    "roslaunch-deps FILE": "launch", "check_urdf FILE": "urdf", "urdf_to_graphviz FILE": "urdf",
    "rosbag info FILE": "bag", "rosbag check FILE": "bag", "rosbag play FILE": "bag",
    "rosbag reindex FILE": "bag", "rosbag filter FILE OUT.bag True": "bag",
    "rosbag convert FILE OUT.mcap": "bag", "rosbag convert -f FILE OUT.bag": "mcap",
    "rosbag info FILE ": "db3", "rosbag compress FILE": "bag", "rosbag merge FILE FILE -o OUT.bag": "bag",
    "rosbag export FILE OUT /t": "bag", "rosmsg show -b FILE std_msgs/String": "bag",
    "pipros policy check FILE": "yaml", "pipros serve --port 0 --policy FILE": "yaml",
    "pipros serve --port 0 --token-file FILE": "txt", "pipros serve --port 0 --cert FILE": "pem",
    "rqt --perspective-file FILE": "perspective", "rviz -d FILE": "rviz", "catkin_test_results FILE": "xml",
    "SHARE/map_server/scripts/map_server FILE": "yaml",
    "SHARE/map_server/scripts/map_server FILE.yaml": "pgm",
    "SHARE/camera_calibration_parsers/scripts/convert FILE OUT.ini": "yaml",
    "SHARE/diagnostic_aggregator/scripts/add_analyzers FILE": "yaml",
    "SHARE/dynamic_reconfigure/scripts/dynparam load /n FILE": "yaml", "pipros dataset --suggest FILE": "bag",
    "pipros dataset BAG --config FILE -o OUT": "yaml", "rosbag table FILE /t -o OUT.csv": "bag",
    "SHARE/stage_ros/scripts/stageros FILE": "world", "pipros port FILE": "py",
    "pipros sim-for FILE": "launch", "rostest FILE": "test", "rosunit FILE": "py", XACRO: "xacro",
    SPARSE: "csv",
}  # fmt: skip
"""Commands, and the ending of the file that they open."""

ACCEPTED = {
    ("rosparam load FILE", "empty"), ("roslaunch --nodes FOLDER/params.launch file:=FILE", "empty"),
    ("rostopic pub -1 -f FILE /t std_msgs/String", "empty"), ("catkin_test_results FILE", "folder"),
    ("rosbag reindex FILE", "cut"), ("pipros port FILE", "empty"),
    *((SPARSE, kind) for kind in ("empty", "deep", "bomb", "cut", "huge")),
    *((XACRO, kind) for kind in (*CONTENTS, "missing", "circle", "huge")),
    *(("rosparam set -t FILE /p", kind) for kind in ("empty", "deep", "bomb", "cut")),
}  # fmt: skip
"""What a command can use, and what xacro itself reports in more lines."""
NAMELESS = {
    ("rostopic echo -b FILE /t", "cut"): "Unindexed bag. Run rosbag reindex",
    ("SHARE/diagnostic_aggregator/scripts/add_analyzers FILE", "empty"): "name a YAML file with the key",
}
"""Errors without the name of the file: those of Noetic, and one about a parameter."""


def make_bag(path: Path) -> bytes:
    with rosbag.Bag(path, "w") as bag:
        for number in range(5):
            bag.write("/t", String(str(number)))
    return path.read_bytes()


GOOD = {
    "launch": b"<launch><group>" + b"<param name='a' value='b'/>" * 9 + b"</group></launch>",
    "urdf": b"<robot name='a'>" + b"<link name='b'/>" * 9 + b"</robot>",
    "perspective": json.dumps({"keys": {}, "groups": {"mainwindow": {}, "pluginmanager": {}}}).encode(),
    "pgm": b"P5 99 99 255\n" + b"x" * 9801,
    "rviz": b"Visualization Manager: {Displays: [{Class: rviz/Grid, Name: Grid}]}\n",
}


@pytest.fixture(scope="module")
def master() -> Iterator[Master]:
    with Master(port=0) as running:
        yield running


@pytest.mark.timeout(600)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_file_that_is_of_no_use_is_named_in_one_line(command: str, tmp_path: Path, master: Master) -> None:
    ending = COMMANDS[command]
    bag = make_bag(tmp_path / "good.bag")
    good = GOOD.get(ending, bag if ending == "bag" else b"a: [1, 2")
    (tmp_path / "params.launch").write_text(
        "<launch><arg name='file'/><rosparam file='$(arg file)'/></launch>"
    )
    (tmp_path / "xacro.launch").write_text(
        "<launch><arg name='file'/><param name='r' command='xacro $(arg file)'/></launch>"
    )
    words = [
        word.replace("SHARE", str(source("pipros/share")))
        .replace("FOLDER", str(tmp_path))
        .replace("BAG", str(tmp_path / "good.bag"))
        for word in command.split()
    ]
    cases = [(kind, str(tmp_path / f"{kind}.{ending}")) for kind in KINDS]
    for kind, file in cases:
        make_unusable(kind, Path(file), good)
        if ending == "pgm":
            Path(f"{file}.yaml").write_text(MAP.replace("FILE", file))
    wrong = {}
    for kind, (status, output) in outcomes(words, cases, tmp_path, {"ROS_MASTER_URI": master.uri}).items():
        fault = faults(status, output, NAMELESS.get((command, kind), f"{kind}.{ending}"))
        if fault and (command, kind) not in ACCEPTED:
            wrong[kind] = fault
    assert wrong == {}


OUTPUTS = {
    "rosbag filter BAG OUT True": "bag", "rosbag fix BAG OUT": "bag", "rosbag convert -f BAG OUT": "mcap",
    "rosbag merge -f BAG BAG -o OUT": "bag", "rosbag table BAG /t -o OUT": "csv",
    "rosbag query BAG 'SELECT * FROM t' -o OUT": "csv", "rosparam dump OUT": "yaml",
}  # fmt: skip
"""Commands, and the ending of the file that they write."""


@pytest.mark.parametrize("command", OUTPUTS)
def test_an_output_that_is_a_link_or_a_folder_stays_one(command: str, tmp_path: Path, master: Master) -> None:
    make_bag(tmp_path / "good.bag")
    real, link, folder = (tmp_path / f"{name}.{OUTPUTS[command]}" for name in ("real", "link", "folder"))
    real.write_text("old")
    real.chmod(0o600)
    link.symlink_to(real)
    folder.mkdir()

    def run(out: Path) -> subprocess.CompletedProcess[str]:
        words = shlex.split(command.replace("BAG", str(tmp_path / "good.bag")).replace("OUT", str(out)))
        variables = {"ROS_MASTER_URI": master.uri, "ROS_HOME": str(tmp_path / "home")}
        program = [VENV_BIN / words[0], *words[1:]]
        return subprocess.run(program, env=variables, capture_output=True, text=True, check=False)

    assert run(link).returncode == 0
    assert (link.is_symlink(), real.stat().st_mode & 0o777) == (True, 0o600)
    assert real.read_bytes() != b"old"
    refused = run(folder)
    assert (refused.returncode, list(folder.iterdir())) == (1, [])
    assert (
        refused.stderr.splitlines()[-1].endswith("Is a directory")
        or f"directory: '{folder}'" in refused.stderr
    )
