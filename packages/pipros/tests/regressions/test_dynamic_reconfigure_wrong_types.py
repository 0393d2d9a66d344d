"""dynamic_reconfigure: one value of the wrong type in a request, and the server changed nothing at all."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pipros.master.master import Master
from pipros_libraries.reconfigure.generator import ParameterGenerator
from tests.support.processes import Processes

CFG = """
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
gen.add("count", int_t, 1, "", 5, 0, 99)
gen.add("speed", double_t, 2, "", 1.0, -10, 10)
gen.add("name", str_t, 4, "", "a")
exit(gen.generate("robot_pkg", "node", "Robot"))
"""
SCRIPT = """
import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter, IntParameter, StrParameter
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import Reconfigure
from robot_pkg.cfg import RobotConfig

def callback(config, level):
    print(level, *(config[name] for name in ("count", "speed", "name")))
    return config

rospy.init_node("robot")
server = Server(RobotConfig, callback)
request = Config(ints=[IntParameter("speed", 3), IntParameter("name", 7)])
request.strs = [StrParameter("count", "many")]
answer = rospy.ServiceProxy("/robot/set_parameters", Reconfigure)(request).config
print([each.name for each in answer.ints], [(each.name, each.value) for each in answer.doubles])
"""


def test_values_of_another_type_are_converted_or_left_out(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    package = tmp_path / "robot_pkg"
    (package / "cfg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robot_pkg</name><version>1.0.0</version></package>")
    (package / "cfg" / "Robot.cfg").write_text(CFG)
    (script := tmp_path / "node.py").write_text(SCRIPT)
    environment = {"ROS_MASTER_URI": master.uri, "ROS_PACKAGE_PATH": str(tmp_path)}
    node = processes.run(sys.executable, str(script), environment=environment)
    assert node.stdout == ["-1 5 1.0 a", "6 5 3.0 7", "['count'] [('speed', 3.0)]"], node.output
    assert "a client's value is ignored: can't set parameter 'count'" in node.output


def test_no_parameter_takes_the_name_of_the_groups() -> None:
    with pytest.raises(ValueError, match="a parameter must not be named groups"):
        ParameterGenerator().add("groups", "int", 0, "")
