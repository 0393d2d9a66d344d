"""Nodes on other machines. The ssh client of these tests runs the command on this machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.ros import RosSystem

SSH = """\
#!/bin/sh
for word; do last=$word; done
echo "ssh was called: $*"
exec sh -c "$last"
"""

LOADER = """\
#!/bin/sh
FROM_LOADER=yes
export FROM_LOADER
exec "$@"
"""

FILE = """\
<launch>
  <machine name="far" address="far.example" user="ada" env-loader="{loader}" timeout="3"/>
  <group ns="g">
    <node machine="far" pkg="programs" type="show" name="there" args="one 'two words'" output="screen"/>
  </group>
  <node pkg="programs" type="show" name="here" args="local" output="screen"/>
</launch>
"""

PROGRAM = """\
#!/bin/sh
echo "$1 of $# loader=$FROM_LOADER ns=$ROS_NAMESPACE master=$ROS_MASTER_URI"
exec sleep 1000
"""


@pytest.fixture
def file(ros: RosSystem) -> Path:
    folder = ros.home / "programs"
    tools = ros.home / "tools_of_the_test"
    for path, content in (
        (tools / "ssh", SSH),
        (folder / "loader", LOADER),
        (folder / "show", PROGRAM),
        (folder / "package.xml", "<package><name>programs</name></package>"),
        (folder / "x.launch", FILE.format(loader=folder / "loader")),
    ):
        path.parent.mkdir(exist_ok=True)
        path.write_text(content)
        path.chmod(0o755)
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    ros.pipros.environment["PATH"] = f"{tools}:{ros.pipros.environment['PATH']}"
    return folder / "x.launch"


def test_a_node_of_another_machine_runs_there_with_its_environment(ros: RosSystem, file: Path) -> None:
    running = ros.pipros.start("roslaunch", file)
    running.wait_for(r"ssh was called: -tt .*ConnectTimeout=3 -p 22 -- ada@far.example ")
    running.wait_for(rf"^one of 3 loader=yes ns=/g master={ros.master_uri}$")
    running.wait_for(r"^local of 3 loader= ns= ")
    running.wait_for("WARNING: nodes on other machines cannot reach the master")
    running.press_ctrl_c()
    assert running.wait() == 0


def test_local_ignores_other_machines(ros: RosSystem, file: Path) -> None:
    running = ros.pipros.start("roslaunch", "--local", file)
    running.wait_for(r"^local of 3")
    assert "ssh was called" not in running.output
    assert "process[g/there" not in running.output
