"""ROS Answers: workspaces whose path has spaces or letters other than ASCII could not be built or sourced."""

from __future__ import annotations

import shlex

from tests.support.ros import RosSystem

MANIFEST = """<package format="2"><name>spaced</name><version>0.1.0</version><description>ä</description>
<maintainer email="a@example.org">Jürgen Müller</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend><depend>rospy</depend><depend>message_generation</depend></package>
"""
CMAKE = """project(spaced)
find_package(catkin REQUIRED COMPONENTS rospy message_generation)
add_message_files(FILES Word.msg)
generate_messages()
catkin_package()
catkin_install_python(PROGRAMS scripts/say.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
"""
PROGRAM = """#!/usr/bin/env python3
import rospy
from spaced.msg import Word
rospy.init_node("say")
print("says", ascii(Word(rospy.get_param("~text")).text), ascii(rospy.get_param("~place")), flush=True)
"""
LAUNCH = """<launch><node pkg="spaced" type="say.py" name="say" output="screen" required="true">
<param name="text" value="größer"/><param name="place" value="$(find spaced)"/></node></launch>
"""


def test_a_workspace_with_spaces_is_built_sourced_and_launched(ros: RosSystem) -> None:
    folder = ros.home / "my wörk 'space"
    package = folder / "src" / "spaced"
    for name, text in {
        "package.xml": MANIFEST,
        "CMakeLists.txt": CMAKE,
        "msg/Word.msg": "string text\n",
        "scripts/say.py": PROGRAM,
        "launch/say.launch": LAUNCH,
    }.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text, "utf-8")
    (package / "scripts/say.py").chmod(0o755)

    built = ros.pipros.run("catkin_make", "-C", str(folder), "install")
    assert built.returncode == 0, built.output

    for space, share in (("devel", package), ("install", folder / "install/share/spaced")):
        setup = shlex.quote(str(folder / space / "setup.bash"))
        ended = ros.pipros.run(
            "bash", "-c", f"source {setup} && exec roslaunch -p {ros.port} spaced say.launch"
        )
        assert f"says 'gr\\xf6\\xdfer' {str(share)!a}" in ended.output
