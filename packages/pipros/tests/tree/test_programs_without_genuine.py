"""The table in docs/guides/libraries.md says what is confirmed of each program that Debian lacks."""

import re
from fnmatch import fnmatchcase

from tests.support.environments import REPOSITORY, SHIPPED

_NAMES = """
    actionlib actionlib_tools bond bondpy camera_calibration camera_calibration_parsers cv_bridge
    depth_image_proc diagnostic_analysis diagnostic_common_diagnostics dynamic_reconfigure genmsg
    genpy image_proc image_transport joint_state_publisher message_filters nodelet pcl_ros
    robot_state_publisher rosbag rosclean rosgraph roslaunch roslib rosmaster rosmsg rosnode rosout
    rosparam rospy rosservice rostest rostopic rosunit roswtf smclib stereo_image_proc tf tf2_py
    tf2_ros tf2_tools topic_tools urdfdom_py xacro
"""
IN_DEBIAN = {*_NAMES.split()}
"""Packages whose genuine programs can be run beside pipros's."""
OWN = {"pipros", "pipros_sim"}
HEADING = "\n## Programs without a genuine one to compare\n"


def test_each_program_without_a_genuine_one_has_one_row() -> None:
    text = (
        (REPOSITORY / "docs" / "reference" / "libraries.md")
        .read_text(encoding="utf-8")
        .partition(HEADING)[2]
        .partition("\n## ")[0]
    )
    rows = [row.split("|")[1:-1] for row in re.findall(r"^\| .*\|$", text, re.MULTILINE)[2:]]
    assert all(len(row) == 3 and (row[1].strip() or row[2].strip()) for row in rows)
    patterns = [name for row in rows for name in row[0].replace(" ", "").split(",")]
    shipped = {folder.name for share in SHIPPED for folder in share.iterdir()}
    packages = {
        scripts.parent.name
        for share in SHIPPED
        for scripts in share.glob("*/scripts")
        if any(scripts.iterdir())
    }

    listed = {name: sum(fnmatchcase(name, pattern) for pattern in patterns) for name in packages}

    assert len(packages) > 60
    assert {name for name, count in listed.items() if count != (name not in IN_DEBIAN | OWN)} == set()
    assert {each for each in patterns if not any(fnmatchcase(name, each) for name in shipped)} == set()
