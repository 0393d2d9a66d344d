"""Twelve packages for tests of wheels, one for each form in which public repositories have packages.

Each has a program `hello`, which prints `NAME works`, and a launch file that starts it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

MANIFEST = """<package format="{format}"><name>{name}</name><version>1.2.3</version>
<description>A package for tests of wheels.</description>
<maintainer email="a@example.org">A</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend>{more}</package>
"""
HEAD = "cmake_minimum_required(VERSION 3.0.2)\nproject({name})\nfind_package(catkin REQUIRED{components})\n"
PROGRAM = "catkin_install_python(PROGRAMS scripts/hello DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
INSTALL = PROGRAM + "install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})\n"
MESSAGES = "add_message_files(FILES State.msg)\ngenerate_messages(DEPENDENCIES std_msgs)\n"
HELLO = (
    "#!/usr/bin/env python3\nimport rospy\n{code}\n"
    "rospy.init_node('hello')\nprint('{name} works', flush=True)\n"
)
LAUNCH = '<launch><node pkg="{name}" type="hello" name="hello" output="screen" required="true"/></launch>\n'
STATE = "std_msgs/Header header\nfloat64[] positions\n"
SETUP = (
    "from distutils.core import setup\n"
    "from catkin_pkg.python_setup import generate_distutils_setup\n"
    "setup(**generate_distutils_setup(packages=['form_module'], package_dir={'': 'src'}))\n"
)
CFG = """#!/usr/bin/env python3
from dynamic_reconfigure.parameter_generator_catkin import ParameterGenerator, double_t

gen = ParameterGenerator()
gen.add("rate", double_t, 0, "Hz", 5, 1, 50)
exit(gen.generate("form_cfg", "form_cfg", "Driver"))
"""


@dataclass(frozen=True, slots=True)
class Form:
    """A package.

    Attributes:
        cmake: its `CMakeLists.txt` after `find_package`.
        components: further words of `find_package`.
        more: further elements of its manifest.
        files: further files, by path.
        code: what its program runs before it prints.
    """

    cmake: str = "catkin_package()\n" + INSTALL
    components: str = ""
    more: str = "<exec_depend>rospy</exec_depend>"
    files: dict[str, str] = field(default_factory=dict)
    code: str = ""
    format: int = 2


FORMS = {
    "form_macro": Form(
        "catkin_package()\nmacro(install_folders)\n  foreach(folder ${ARGN})\n"
        "    install(DIRECTORY ${folder} DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})\n"
        f"  endforeach()\nendmacro()\ninstall_folders(launch config)\n{PROGRAM}",
        files={"config/arm.yaml": "speed: 1\n"},
        code="import os, rospkg\n"
        "assert os.path.exists(rospkg.RosPack().get_path('form_macro') + '/config/arm.yaml')",
    ),
    "form_three": Form(
        more='<exec_depend condition="$ROS_PYTHON_VERSION == 2">python-yaml</exec_depend>'
        '<exec_depend condition="$ROS_PYTHON_VERSION == 3">python3-yaml</exec_depend>'
        "<member_of_group>forms</member_of_group>",
        code="import yaml",
        format=3,
    ),
    "form_cfg": Form(
        f"generate_dynamic_reconfigure_options(cfg/Driver.cfg)\ncatkin_package()\n{INSTALL}",
        " COMPONENTS dynamic_reconfigure",
        "<depend>dynamic_reconfigure</depend>",
        {"cfg/Driver.cfg": CFG},
        "from form_cfg.cfg import DriverConfig\nassert DriverConfig.defaults == {'rate': 5.0}",
    ),
    "form_mixed": Form(
        f"{MESSAGES}catkin_package(LIBRARIES form_mixed)\nadd_library(form_mixed src/mixed.cpp)\n"
        "add_executable(mixed src/main.cpp)\ntarget_link_libraries(mixed form_mixed ${catkin_LIBRARIES})\n"
        "install(TARGETS mixed form_mixed RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION}\n"
        "  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})\n"
        "install(DIRECTORY include/form_mixed/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})\n"
        + INSTALL,
        " COMPONENTS message_generation roscpp std_msgs",
        "<depend>roscpp</depend><depend>std_msgs</depend><build_depend>message_generation</build_depend>",
        {
            "msg/State.msg": STATE,
            "src/mixed.cpp": "",
            "src/main.cpp": "int main() {}\n",
            "include/form_mixed/a.h": "",
        },
        "from form_mixed.msg import State",
    ),
    "form_nested": Form(
        "add_message_files(DIRECTORY msg FILES Arm.msg)\n"
        "add_message_files(DIRECTORY msg/parts FILES Joint.msg)\n"
        f"generate_messages(DEPENDENCIES std_msgs)\ncatkin_package()\n{INSTALL}",
        " COMPONENTS message_generation std_msgs",
        "<depend>std_msgs</depend><build_depend>message_generation</build_depend>",
        {
            "msg/Arm.msg": "std_msgs/Header header\nJoint[2] joints\n",
            "msg/parts/Joint.msg": "float64 angle\n",
        },
        "from form_nested.msg import Arm\nassert Arm().joints[1].angle == 0",
    ),
    "form_programs": Form(
        "catkin_package()\ninstall(PROGRAMS scripts/hello scripts/tool DESTINATION "
        "${CATKIN_PACKAGE_BIN_DESTINATION})\ninstall(DIRECTORY launch DESTINATION share/${PROJECT_NAME})\n",
        files={"scripts/tool": "#!/bin/sh\necho tool\n"},
    ),
    "form_plugins": Form(
        "catkin_package()\ninstall(FILES plugin.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})\n"
        + INSTALL,
        more="<exec_depend>rospy</exec_depend><exec_depend>form_three</exec_depend>"
        '<export><form_three plugin="${prefix}/plugin.xml"/></export>',
        files={"plugin.xml": '<library path="src"><class name="Form" type="form.Form"/></library>\n'},
        code="import os, subprocess\nwords = ['rospack', 'plugins', '--attrib=plugin', 'form_three']\n"
        "assert os.path.exists(subprocess.check_output(words, text=True).split()[1])",
    ),
    "form_nothing": Form("catkin_package()\n"),
    "form_action": Form(
        "add_action_files(FILES Move.action)\nadd_service_files(FILES Stop.srv)\n"
        f"generate_messages(DEPENDENCIES actionlib_msgs std_msgs)\ncatkin_package()\n{INSTALL}",
        " COMPONENTS actionlib_msgs message_generation std_msgs",
        "<depend>actionlib_msgs</depend><depend>std_msgs</depend><build_depend>message_generation</build_depend>",
        {
            "action/Move.action": "float64 goal\n---\n---\nfloat64 now\n",
            "srv/Stop.srv": "---\nbool success\n",
        },
        "from form_action.msg import MoveActionGoal\nfrom form_action.srv import StopResponse",
    ),
    "form_one": Form(
        f"{MESSAGES}catkin_package(CATKIN_DEPENDS message_runtime)\n{INSTALL}",
        " COMPONENTS message_generation std_msgs",
        "<build_depend>message_generation</build_depend><build_depend>std_msgs</build_depend>"
        "<run_depend>message_runtime</run_depend><run_depend>std_msgs</run_depend>",
        {"msg/State.msg": STATE},
        "from form_one.msg import State",
        format=1,
    ),
    "form_module": Form(
        f"catkin_python_setup()\n{MESSAGES}catkin_package()\n{INSTALL}",
        " COMPONENTS message_generation std_msgs",
        "<depend>std_msgs</depend><build_depend>message_generation</build_depend>",
        {"msg/State.msg": STATE, "setup.py": SETUP, "src/form_module/__init__.py": "WHO = 'module'\n"},
        "from form_module import WHO\nfrom form_module.msg import State\nassert WHO == 'module'",
    ),
    "form_unknown": Form("catkin_package()\nlab_install_all(launch scripts)\n", " COMPONENTS lab_tools"),
}


def write_forms(folder: Path) -> list[str]:
    """Write the packages below a folder, and return their names."""
    for name, form in FORMS.items():
        files = {
            "package.xml": MANIFEST.format(name=name, format=form.format, more=form.more),
            "CMakeLists.txt": HEAD.format(name=name, components=form.components) + form.cmake,
            "scripts/hello": HELLO.format(name=name, code=form.code),
            "launch/hello.launch": LAUNCH.format(name=name),
            **form.files,
        }
        for path, text in files.items():
            file = folder / name / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
            if path.startswith("scripts/"):
                file.chmod(0o755)
    return sorted(FORMS)
