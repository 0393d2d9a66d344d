"""Workspaces of the shapes of public repositories, each with the files that its wheels must contain."""

from dataclasses import dataclass, field
from pathlib import Path

from tests.support.workspaces import MANIFEST

_SHARE = "${CATKIN_PACKAGE_SHARE_DESTINATION}"
_BIN = "${CATKIN_PACKAGE_BIN_DESTINATION}"
_LAUNCH = f"install(DIRECTORY launch DESTINATION {_SHARE})\n"
_CATKIN = "find_package(catkin REQUIRED)\ncatkin_package()\n"
_SCRIPT = f"catkin_install_python(PROGRAMS scripts/run DESTINATION {_BIN})\n"
_CFG = (
    "from dynamic_reconfigure.parameter_generator_catkin import *\ngen = ParameterGenerator()\n"
    "gen.add('rate', double_t, 0, 'Hz', 5, 1, 50)\nexit(gen.generate('tune', 'tune', 'Tune'))\n"
)


@dataclass(frozen=True, slots=True)
class Pack:
    """A package of a workspace.

    Attributes:
        expected: the files of its wheel, without `package.xml`, with `@` for `share/NAME` and `{0}` for NAME;
            None if no wheel is built.
        cmake: its `CMakeLists.txt` after `project()`; None if it has no such file.
        files: further files, separated by spaces. The content depends on the suffix.
        texts: files with other contents, by path.
        links: links with their targets, by path.
        said: a part of a note or an error about the package; empty if nothing may be said.
        more: further elements of its manifest.
    """

    expected: str | None
    cmake: str | None = _CATKIN
    depends: str = ""
    files: str = ""
    texts: dict[str, str] = field(default_factory=dict)
    links: dict[str, str] = field(default_factory=dict)
    said: str = ""
    more: str = ""


def _with(components: str, rest: str) -> str:
    return f"find_package(catkin REQUIRED COMPONENTS {components})\n{rest}"


def _setup(arguments: str) -> str:
    return (
        "from setuptools import setup\nfrom catkin_pkg.python_setup import generate_distutils_setup\n"
        f"setup(**generate_distutils_setup({arguments}))\n"
    )


# fmt: off
_GENERATED = "{0}/__init__.py {0}/py.typed {0}/msg/__init__.pyi @/CMakeLists.txt @/msg/State.msg"


def _messages(needs: str = "", text: str = "int8 a\n") -> Pack:
    made = f"add_message_files(FILES State.msg)\ngenerate_messages(DEPENDENCIES std_msgs {needs})\n"
    return Pack(_GENERATED, _with(f"message_generation std_msgs {needs}", f"{made}catkin_package()\n"),
        f"std_msgs {needs}", texts={"msg/State.msg": text})


_PYTHON = "find_package(catkin REQUIRED)\ncatkin_python_setup()\ncatkin_package()\n"
_NODE = Pack("lib/{0}/run @/launch/run.launch", _with("rospy", f"catkin_package()\n{_SCRIPT}{_LAUNCH}"),
             "rospy", "scripts/run launch/run.launch")
WORKSPACES: dict[str, dict[str, Pack]] = {
    "twelve packages of messages": {f"part{n}": _messages() for n in range(1, 13)},
    "messages that need each other": {"base_msgs": _messages(),
        "arm_msgs": _messages("base_msgs", "std_msgs/Header header\nbase_msgs/State[] states\n"),
        "a_robot_msgs": _messages("arm_msgs", "arm_msgs/State arm\n")},
    "services and actions": {"deeds": Pack(
        "deeds/__init__.py deeds/py.typed @/CMakeLists.txt deeds/msg/__init__.pyi deeds/srv/__init__.pyi "
        "@/srv/Stop.srv @/action/Move.action",
        _with("message_generation actionlib_msgs",
              "add_service_files(FILES Stop.srv)\nadd_action_files(FILES Move.action)\n"
              "generate_messages(DEPENDENCIES actionlib_msgs)\ncatkin_package()\n"),
        "actionlib_msgs", "srv/Stop.srv action/Move.action",
    )},
    "C++ and Python mixed": {"mixed": Pack(
        "mixed_py/__init__.py lib/mixed/run @/launch/run.launch",
        _with("roscpp rospy", "catkin_python_setup()\ncatkin_package(INCLUDE_DIRS include LIBRARIES mixed)\n"
              "find_package(Eigen3 REQUIRED)\nadd_library(mixed src/mixed.cpp)\n"
              "add_executable(node src/node.cpp)\ntarget_link_libraries(node mixed ${catkin_LIBRARIES})\n"
              f"install(TARGETS node RUNTIME DESTINATION {_BIN})\n{_SCRIPT}{_LAUNCH}"),
        "roscpp rospy",
        "src/mixed.cpp src/node.cpp include/mixed/a.h scripts/run launch/run.launch src/mixed_py/__init__.py",
        {"setup.py": _setup("packages=['mixed_py'], package_dir={'': 'src'}")},
        said="left out, because they are compiled: mixed (",
    )},
    "catkin_simple": {
        "simple": Pack(
            "@/CMakeLists.txt @/scripts/run @/launch/run.launch",
            "find_package(catkin_simple REQUIRED)\ncatkin_simple(ALL_DEPS_REQUIRED)\n"
            "cs_install_scripts(scripts/run)\ncs_install()\ncs_export()\n",
            "catkin_simple", "scripts/run launch/run.launch",
            said="needs catkin_simple() | needs cs_install_scripts() | needs cs_install() | "
                 "needs cs_export()",
        ),
        "beside": _NODE,
    },
    "catkin_virtualenv": {
        "virtual": Pack(
            "lib/virtual/run @/CMakeLists.txt @/scripts/run @/requirements.txt",
            _with("catkin_virtualenv",
                  f"catkin_package()\ncatkin_generate_virtualenv(PYTHON_INTERPRETER python3)\n{_SCRIPT}"),
            "catkin_virtualenv", "scripts/run requirements.txt", said="needs catkin_generate_virtualenv()",
            more="  <export><pip_requirements>requirements.txt</pip_requirements></export>\n",
        ),
        "beside": _NODE,
    },
    "links inside of a package": {"linked": Pack(
        "@/launch/run.launch @/launch/same.launch @/now.yaml @/launch/configs/a.yaml",
        f"{_CATKIN}{_LAUNCH}install(FILES now.yaml DESTINATION {_SHARE})\n",
        files="launch/run.launch configs/a.yaml",
        links={"now.yaml": "configs/a.yaml", "launch/same.launch": "run.launch",
               "launch/configs": "../configs"},
    )},
    "links between packages and a loop": {
        "owner": Pack("@/launch/run.launch", _CATKIN + _LAUNCH, files="launch/run.launch"),
        "borrower": Pack(None, _CATKIN + _LAUNCH, links={"launch": "../owner/launch"},
                         said="launch, which is outside of the package"),
        "looped": Pack(None, _CATKIN + _LAUNCH, files="launch/run.launch", links={"launch/loop": "../launch"},
                       said="is a link to a folder that contains it"),
    },
    "a metapackage": {
        "stack": Pack("@/CMakeLists.txt", "find_package(catkin REQUIRED)\ncatkin_metapackage()\n", "part_one",
                      more="  <export><metapackage/></export>\n"),
        "part_one": _NODE,
    },
    "an overlay of a package of pipros": {
        "std_msgs": Pack(_GENERATED, _with("message_generation", "add_message_files(FILES State.msg)\n"
                                           "generate_messages()\ncatkin_package()\n"), files="msg/State.msg"),
        "user": _NODE,
    },
    "a package of pipros with Python code": {
        "rosapi": Pack(None, _PYTHON, files="src/rosapi/__init__.py src/rosapi/proxy.py",
                       texts={"setup.py": _setup("packages=['rosapi'], package_dir={'': 'src'}")},
                       said="not built, because pipros itself installs this package"),
        "bridge_server": Pack("@/launch/run.launch", _with("rosapi", f"catkin_package()\n{_LAUNCH}"),
                              "rosapi", "launch/run.launch"),
    },
    "plug-ins": {"plug": Pack(
        "plug/__init__.py plug/view.py @/plugin.xml @/resource/view.ui bin/plug_view lib/plug/plug_view",
        _with("rospy", f"catkin_python_setup()\ncatkin_package()\n"
              f"install(FILES plugin.xml DESTINATION {_SHARE})\n"),
        "rospy", "plugin.xml src/plug/__init__.py src/plug/view.py resource/view.ui",
        {"setup.py": _setup("packages=['plug'], package_dir={'': 'src'}, scripts=['scripts/plug_view'],"
                            " data_files=[('share/plug/resource', ['resource/view.ui'])]"),
         "scripts/plug_view": "#!/usr/bin/env python3\n"},
        more='  <export><rqt_gui plugin="${prefix}/plugin.xml"/></export>\n',
    )},
    "extras made by a template": {
        "a_user": Pack("@/lab/a.txt", _with("tools", "catkin_package()\nlab_install(a.txt)\n"),
                       files="a.txt"),
        "tools": Pack(
            "@/cmake/cfg_extras.txt @/cmake/lab.cmake @/cmake/lab.cmake.em",
            "find_package(catkin REQUIRED)\ncatkin_package(CFG_EXTRAS lab.cmake)\n"
            f"install(FILES cmake/lab.cmake.em DESTINATION {_SHARE}/cmake)\n",
            texts={"cmake/lab.cmake.em": "@[if DEVELSPACE]@\nmacro(lab_install name)\n  install(FILES "
                   "${name} DESTINATION share/${PROJECT_NAME}/lab)\nendmacro()\n@[end if]@\n"},
        ),
    },
    "repositories in folders": {"repo/one": _NODE,
        "repo/deeper/two": Pack("@/launch/run.launch", _CATKIN + _LAUNCH, "one", "launch/run.launch"),
        "repo/ignored": Pack(None, files="CATKIN_IGNORE")},
    "Python with a setup.py": {"snake": Pack(
        "snake/__init__.py snake/deep/__init__.py snake/deep/a.yaml lone.py bin/snake_cli @/CMakeLists.txt "
        "@/setup.py @/src/snake/deep/a.yaml", _PYTHON,
        files="src/snake/__init__.py src/snake/deep/__init__.py src/snake/deep/a.yaml src/lone.py",
        texts={"setup.py": _setup(
            "packages=['snake', 'snake.deep'], package_dir={'': 'src'}, py_modules=['lone'],"
            " entry_points={'console_scripts': ['snake_cli = lone:main']}")},
        said="installs no files, so the folder is added as a whole",
    )},
    "Python without CMakeLists.txt": {"bare": Pack(
        "bare/__init__.py @/launch/run.launch @/setup.py", None,
        files="src/bare/__init__.py launch/run.launch",
        texts={"setup.py": _setup("packages=['bare'], package_dir={'': 'src'}")},
        said="CMakeLists.txt does not exist, so the folder is added as a whole",
    )},
    "dynamic_reconfigure": {"tune": Pack(
        "tune/__init__.py @/cfg/Tune.cfg @/launch/run.launch",
        _with("dynamic_reconfigure",
              f"generate_dynamic_reconfigure_options(cfg/Tune.cfg)\ncatkin_package()\n{_LAUNCH}"),
        "dynamic_reconfigure", "launch/run.launch", {"cfg/Tune.cfg": _CFG},
    )},
    "subdirectories, macros and configured files": {"deep": Pack(
        "@/texts/a.txt @/texts/b.txt @/texts/c.txt @/who.yaml",
        "find_package(catkin REQUIRED)\ncatkin_package()\nset(WHO robot)\nadd_subdirectory(parts)\n"
        "configure_file(who.yaml.in ${CMAKE_CURRENT_BINARY_DIR}/who.yaml @ONLY)\n"
        f"foreach(name a b)\n  install(FILES ${{name}}.txt DESTINATION {_SHARE}/texts)\nendforeach()\n"
        f"install(FILES ${{CMAKE_CURRENT_BINARY_DIR}}/who.yaml DESTINATION {_SHARE})\n",
        files="a.txt b.txt parts/c.txt",
        texts={"who.yaml.in": "who: @WHO@\n",
               "parts/CMakeLists.txt": f"install(FILES c.txt DESTINATION {_SHARE}/texts)\n"},
    )},
    "tests only for developers": {"tested": Pack(
        "lib/tested/run",
        _with("rospy", f"catkin_package()\n{_SCRIPT}if(CATKIN_ENABLE_TESTING)\n"
              "  find_package(rostest REQUIRED)\n  add_rostest(test/a.test)\n"
              "  catkin_add_nosetests(test)\nendif()\n"),
        "rospy", "scripts/run test/a.test test/test_a.py",
    )},
    "one CMake error among good packages": {
        "a_tools": Pack(
            None, "find_package(catkin REQUIRED)\nfind_package(lab_absent 2.0 REQUIRED)\n"
            "message(FATAL_ERROR no)\n",
            said="CMake Error at ",
        ),
        "b_user": Pack(None, depends="a_tools",
                       said="it is left out, because it needs a_tools, which failed"),
        "c_node": _NODE, "d_msgs": _messages(),
    },
    "format 3, conditions and a byte order mark": {"three": Pack(
        "@/launch/run.launch", _with("rospy", f"catkin_package()\n{_LAUNCH}"), "rospy", "launch/run.launch",
        {"package.xml": "\ufeff" + MANIFEST.format(
            name="three", more='  <exec_depend condition="$ROS_VERSION == 2">rclpy</exec_depend>\n'
            "  <exec_depend>rospy</exec_depend>\n  <member_of_group>robots</member_of_group>\n",
        ).replace('format="2"', 'format="3"')},
    )},
    "scripts and folders installed by hand": {"handy": Pack(
        "lib/handy/run @/config/a.yaml",
        f"{_CATKIN}install(PROGRAMS scripts/run DESTINATION {_BIN})\n"
        f"install(DIRECTORY config/ DESTINATION {_SHARE}/config FILES_MATCHING "
        'PATTERN "*.yaml" PATTERN "old" EXCLUDE)\n'
        "install(FILES rules/a.rules DESTINATION /etc/udev/rules.d)\n",
        files="scripts/run config/a.yaml config/a.bag config/old/b.yaml rules/a.rules launch/run.launch",
        said="installed outside of the prefix, to /etc/udev/rules.d | launch is not in the wheel",
    )},
}
# fmt: on
RUNS = "#!/usr/bin/env python3\nimport rospy\nrospy.init_node('run')\nprint('{0} works', flush=True)\n"
"""What each `scripts/run` contains."""
_CONTENTS = {".msg": "int8 a\n", ".srv": "---\nbool ok\n", ".action": "---\n---\nint8 a\n"}
_CONTENTS[".launch"] = '<launch><node pkg="{0}" type="run" name="run"/></launch>\n'


def write_workspace(packs: dict[str, Pack], folder: Path) -> None:
    """Write the packages of a workspace below `folder`."""
    for path, pack in packs.items():
        root, name = folder / path, path.rpartition("/")[2]
        needed = "".join(f"  <depend>{item}</depend>\n" for item in pack.depends.split())
        texts = {"package.xml": MANIFEST.format(name=name, more=needed + pack.more)}
        if pack.cmake is not None:
            texts["CMakeLists.txt"] = f"cmake_minimum_required(VERSION 3.0.2)\nproject({name})\n{pack.cmake}"
        texts |= {file: _CONTENTS.get(Path(file).suffix, "").format(name) for file in pack.files.split()}
        texts |= {"scripts/run": RUNS.format(name)} if "scripts/run" in texts else {}
        for file, text in (texts | pack.texts).items():
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            (root / file).write_text(text)
        if "scripts/run" in texts:
            (root / "scripts" / "run").chmod(0o755)
        for file, target in pack.links.items():
            (root / file).symlink_to(target)
