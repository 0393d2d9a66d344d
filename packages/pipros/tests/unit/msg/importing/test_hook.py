"""Importing messages straight from definition files, each in a fresh Python process."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.support.environments import REPOSITORY, ROOTS

IMPORTED = "import sys; print(sorted(name for name in sys.modules if name.startswith('pipros')))"
MANIFEST = "<package><name>{}</name><version>0.0.1</version></package>"


def is_new_enough(python: str) -> bool:
    asked = "import sys; sys.exit(sys.version_info < (3, 10))"
    return Path(python).exists() and subprocess.run([python, "-c", asked]).returncode == 0


class Workspace:
    """ROS packages in a folder, and Python processes with this folder on their package path."""

    def __init__(self, folder: Path) -> None:
        self.source = folder / "src"
        self.home = folder / "home"
        self.working_folder = folder
        self.python = Path(sys.executable)

    def package(self, name: str, **files: str) -> Path:
        folder = self.source / name
        files["package.xml"] = MANIFEST.format(name)
        for path, text in files.items():
            file = folder / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return folder

    def run(self, code: str, **variables: str) -> subprocess.CompletedProcess[str]:
        environment = {
            key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "PYTHON"))
        }
        environment |= {"ROS_PACKAGE_PATH": str(self.source), "ROS_HOME": str(self.home), **variables}
        return subprocess.run(
            [self.python, "-c", code],
            cwd=self.working_folder,
            env=environment,
            capture_output=True,
            text=True,
        )

    def shows(self, code: str, **variables: str) -> str:
        result = self.run(code, **variables)
        assert result.returncode == 0, result.stderr
        return result.stdout.strip()

    def fails(self, code: str) -> str:
        result = self.run(code)
        assert result.returncode == 1
        return result.stderr.strip().splitlines()[-1]


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


def test_included_messages_are_importable_without_a_package_path(workspace: Workspace) -> None:
    code = "from std_msgs.msg import String; from std_srvs.srv import Empty; print(String('hi'), Empty._type)"
    assert workspace.shows(code, ROS_PACKAGE_PATH="") == 'data: "hi" std_srvs/Empty'


def test_a_package_of_definitions_is_a_python_package(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/Arm.msg": "Hand left\nHand right", "msg/Hand.msg": "int8[5] fingers"})
    code = "from robot.msg import Arm, Hand; print(Arm(left=Hand([1] * 5)).left.fingers)"
    assert workspace.shows(code) == "[1, 1, 1, 1, 1]"


def test_messages_may_embed_those_of_other_packages(workspace: Workspace) -> None:
    workspace.package("first", **{"msg/A.msg": "std_msgs/Header h\nsecond/B b"})
    workspace.package("second", **{"msg/B.msg": "geometry_msgs/Point[] points"})
    code = "from first.msg import A; from second.msg import B; print(type(A().b) is B, A().b.points)"
    assert workspace.shows(code) == "True []"


def test_services_have_their_halves(workspace: Workspace) -> None:
    workspace.package("robot", **{"srv/Ask.srv": "string what\n---\nint32 answer"})
    code = (
        "from robot.srv import Ask, AskRequest as Q, AskResponse as R; print(Ask._request_class is Q, R(42))"
    )
    assert workspace.shows(code) == "True answer: 42"


def test_actions_are_messages(workspace: Workspace) -> None:
    workspace.package("robot", **{"action/Walk.action": "float32 far\n---\n---\nfloat32 done"})
    code = "from robot.msg import WalkAction, WalkGoal; print(WalkGoal(2.5), WalkAction.__slots__)"
    assert workspace.shows(code) == "far: 2.5 ['action_goal', 'action_result', 'action_feedback']"


def test_a_package_may_have_python_modules_and_messages(workspace: Workspace) -> None:
    files = {
        "msg/A.msg": "int32 x",
        "src/robot/__init__.py": "",
        "src/robot/tools.py": "from robot.msg import A\nmade = A(3)",
    }
    workspace.package("robot", **files)
    assert workspace.shows("from robot.tools import made; print(made)") == "x: 3"


def test_a_package_with_modules_looks_as_one_that_python_found_itself(workspace: Workspace) -> None:
    folder = workspace.package("robot", **{"msg/A.msg": "int32 x", "src/robot/__init__.py": ""})
    shown = "print(robot.__file__, list(robot.__path__), robot.__spec__.cached)"

    found = workspace.shows(f"import robot; {shown}")

    assert found == workspace.shows(
        f"import robot; {shown}", ROS_PACKAGE_PATH="", PYTHONPATH=str(folder / "src")
    )


def test_packages_in_the_working_folder_do_not_interfere(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/A.msg": "int32 x"})
    workspace.working_folder = workspace.source
    assert workspace.shows("from robot.msg import A; print(A(3))") == "x: 3"


def test_modules_are_found_where_the_working_folder_hides_their_package(workspace: Workspace) -> None:
    files = {
        "src/robot/__init__.py": "ready = True",
        "src/robot/tools.py": "import robot\nmade = robot.ready",
    }
    workspace.package("robot", **files)
    workspace.working_folder = workspace.source

    assert workspace.shows("from robot.tools import made; from robot import tools; print(made)") == "True"
    assert workspace.fails("import robot.nope") == "ModuleNotFoundError: No module named 'robot.nope'"


def test_a_python_package_that_genpy_generated_wins(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/A.msg": "int32 x"})
    generated = workspace.working_folder / "devel" / "robot" / "msg"
    generated.mkdir(parents=True)
    (generated.parent / "__init__.py").touch()
    (generated / "__init__.py").write_text("A = 'generated'")
    code = "from robot.msg import A; print(A)"
    assert workspace.shows(code, PYTHONPATH=str(workspace.working_folder / "devel")) == "generated"


def test_a_star_import_gives_all_types(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/A.msg": "int32 x", "msg/B.msg": "A a", "srv/S.srv": "---"})
    code = (
        "from robot.msg import *; from robot.srv import *; print(A.__name__, B.__name__, SRequest.__name__)"
    )
    assert workspace.shows(code) == "A B SRequest"


def test_a_star_import_gives_the_modules_that_generated_code_imports(workspace: Workspace) -> None:
    workspace.package("robot", **{"srv/Ask.srv": "---\nsecond/B[] b", "srv/No.srv": "---"})
    workspace.package("second", **{"msg/B.msg": "third/C c"})
    workspace.package("third", **{"msg/C.msg": "string struct"})
    code = "from robot.srv import *; print(genpy.Time(1), struct.pack, second.msg.B(), third.msg.C, {})"
    assert workspace.shows(code.format("sys, codecs, python3")).startswith(
        "1000000000 <built-in function pack> c:"
    )
    assert workspace.fails(code.format("robot")) == "NameError: name 'robot' is not defined"


def test_a_message_type_wins_over_a_module_of_its_name(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/struct.msg": "int32 x", "msg/B.msg": "int32 x"})
    assert (
        workspace.shows("from robot.msg import *; print(struct(1), B(2), genpy.__name__)")
        == "x: 1 x: 2 genpy"
    )


def test_modules_of_single_types_have_the_names_of_generated_code(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/A.msg": "std_msgs/Header header"})
    code = "import robot.msg._A as a; print(a.genpy.__name__, hasattr(a, 'nothing'))"
    assert workspace.shows(code) == "genpy False"
    code = "from robot.msg._A import *; print(A.__name__, std_msgs.msg.Header._type)"
    assert workspace.shows(code) == "A std_msgs/Header"


def test_dir_lists_the_names_for_editors(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/A.msg": "int32 x", "msg/Broken.msg": "int32"})
    assert (
        workspace.shows("import robot.msg as m; print([n for n in dir(m) if n[0] != '_'])")
        == "['A', 'Broken']"
    )


def test_classes_are_in_the_modules_of_genpy_so_that_pickles_are_portable(workspace: Workspace) -> None:
    from std_msgs.msg import String

    assert String.__module__ == "std_msgs.msg._String"
    code = f"import pickle; print(pickle.loads({pickle.dumps(String('hi'))!r}))"
    assert workspace.shows(code, ROS_PACKAGE_PATH="") == 'data: "hi"'


def test_a_mistake_is_found_when_the_type_is_first_used(workspace: Workspace) -> None:
    folder = workspace.package("robot", **{"msg/A.msg": "int32 x", "msg/B.msg": "int32 x\n\nint32 a b"})
    assert workspace.shows("from robot.msg import A; print(A())") == "x: 0"
    assert workspace.fails("from robot.msg import B") == (
        f"pipros.msg.language.spec.DefinitionError: {folder}/msg/B.msg:3:1: "
        "expected a type and a name, got [int32 a b]"
    )


def test_an_unknown_name_is_an_import_error(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/A.msg": "int32 x"})
    assert workspace.fails("from robot.msg import C").startswith(
        "ImportError: cannot import name 'C' from 'robot.msg'"
    )
    assert workspace.fails("import no_robot") == "ModuleNotFoundError: No module named 'no_robot'"
    assert workspace.fails("import robot.srv") == "ModuleNotFoundError: No module named 'robot.srv'"


def test_an_unknown_embedded_type_is_named_with_the_field_that_uses_it(workspace: Workspace) -> None:
    folder = workspace.package("robot", **{"msg/A.msg": "no_such_package/B b"})
    complaint = workspace.fails("from robot.msg import A")
    assert complaint.startswith(
        f"pipros.msg.language.spec.UnknownType: {folder}/msg/A.msg:1:1: unknown type [no_such_package/B]"
    )
    assert "ROS_PACKAGE_PATH is" in complaint


def test_the_start_of_python_imports_only_a_few_modules(workspace: Workspace) -> None:
    assert (
        workspace.shows(IMPORTED)
        == "['pipros', 'pipros.msg', 'pipros.msg.importing', 'pipros.msg.importing.hook', 'pipros.startup']"
    )


@pytest.fixture(params=[path for path in ("/usr/bin/python3", sys.executable) if is_new_enough(path)])
def environment_of_its_own(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A virtual environment with pipros: of Debian's Python with its `sitecustomize`, and of this one."""
    folder = tmp_path / "environment"
    subprocess.run([request.param, "-m", "venv", "--without-pip", folder], check=True)
    (site_packages,) = folder.glob("lib/python*/site-packages")
    folders = "\n".join(map(str, ROOTS))
    hook = (REPOSITORY / "packages/pipros/pipros.pth").read_text()
    (site_packages / "pipros.pth").write_text(f"{folders}\n{hook}")
    return folder / "bin" / "python"


def test_no_package_is_searched_at_the_start_of_python(
    workspace: Workspace, environment_of_its_own: Path
) -> None:
    (workspace.working_folder / "sitecustomize.py").write_text(
        "try:\n    import no_such_module\nexcept ImportError:\n    tried = True\n"
    )
    workspace.python = environment_of_its_own
    at_start = (
        "['pipros', 'pipros.msg', 'pipros.msg.importing', 'pipros.msg.importing.hook', 'pipros.startup']"
    )
    assert workspace.shows(IMPORTED) == at_start
    customized = f"{IMPORTED}; import sitecustomize; assert sitecustomize.tried"
    assert workspace.shows(customized, PYTHONPATH=str(workspace.working_folder)) == at_start


def test_a_disabled_hook_is_installed_by_rospy(workspace: Workspace, environment_of_its_own: Path) -> None:
    workspace.python = environment_of_its_own
    assert workspace.shows(IMPORTED, PIPROS_NO_IMPORT_HOOK="1") == "[]"
    assert workspace.shows(IMPORTED, PIPROS_NO_IMPORT_HOOK="") != "[]"
    modules = str(Path(yaml.__file__).parents[1])
    for first in ("rospy", "roslib", "std_srvs", "pipros.startup", "pipros.msg.importing.load"):
        code = f"import {first}; from std_msgs.msg import String; print(String('hi'))"
        assert workspace.shows(code, PIPROS_NO_IMPORT_HOOK="1", PYTHONPATH=modules) == 'data: "hi"'


@pytest.mark.parametrize("modules", [{}, {"src/robot/__init__.py": ""}], ids=["messages", "and modules"])
def test_a_message_from_the_cache_is_imported_without_the_large_modules_of_python(
    workspace: Workspace, modules: dict[str, str]
) -> None:
    workspace.package("robot", **{"msg/One.msg": "string text\n", **modules})
    large = {"contextlib", "dataclasses", "functools", "logging", "pathlib", "re", "typing"}
    code = f"""
import sys
before = set(sys.modules)
from robot.msg import One
print(sorted({large} & (set(sys.modules) - before)))
"""
    workspace.shows(code)
    assert workspace.shows(code) == "[]"


def test_a_failed_import_does_not_search_an_empty_package_path(workspace: Workspace) -> None:
    code = """
import sys
try:
    import no_such_module
except ImportError:
    print("pipros.packages.package_folders" in sys.modules)
"""
    assert workspace.shows(code, ROS_PACKAGE_PATH="") == "False"


def test_types_of_a_package_no_longer_on_the_path_are_not_found(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/One.msg": "", "msg/Two.msg": ""})
    shown = workspace.shows(
        "import os; from robot import msg; msg.One; os.environ['ROS_PACKAGE_PATH'] = '/dev/null'; "
        "print(hasattr(msg, 'One'), hasattr(msg, 'Two'), 'Two' in dir(msg))"
    )
    assert shown == "True False False"


def test_classes_are_found_by_type_name(workspace: Workspace) -> None:
    workspace.package("robot", **{"msg/A.msg": "int32 x"})
    load = "from pipros.msg import load_message_class as load;"
    assert workspace.shows(f"{load} from robot.msg import A; print(load('robot/A') is A)") == "True"
    for name in ("robot/B", "no_robot/A"):
        complaint = workspace.fails(f"{load} load('{name}')")
        assert complaint.startswith("pipros.basics.errors.NotFound: there is no ")


SETUP = "from setuptools import setup\nsetup(packages=['{0}'], package_dir={{'': 'python'}})\n"


def test_modules_are_importable_from_the_folders_of_a_setup_py(workspace: Workspace) -> None:
    workspace.package(
        "robot_driver",
        **{
            "setup.py": SETUP.format("robot_lib"),
            "python/robot_lib/__init__.py": "from robot_lib.arm import REACH\n",
            "python/robot_lib/arm.py": "REACH = 3\n",
        },
    )
    workspace.package(
        "robot",
        **{
            "setup.py": SETUP.format("robot"),
            "python/robot/__init__.py": "WORD = 1\n",
            "msg/A.msg": "int32 x",
        },
    )
    workspace.package("plain", **{"msg/A.msg": "int32 x"})
    shown = workspace.shows(
        "import robot, robot_lib, robot_lib.arm\nfrom robot.msg import A\nfrom plain.msg import A as B\n"
        "print(robot.WORD, robot_lib.REACH, A._type, B._type)"
    )
    assert shown == "1 3 robot/A plain/A"


def test_a_module_that_no_setup_py_names_is_not_found(workspace: Workspace) -> None:
    workspace.package("robot", **{"setup.py": SETUP.format("other"), "python/lib/__init__.py": ""})
    assert "No module named 'lib'" in workspace.fails("import lib")


def test_a_python_package_of_the_workspace_wins_over_an_installed_one(workspace: Workspace) -> None:
    code = "import xacro; print(getattr(xacro, 'here', 'installed'))"
    assert workspace.shows(code) == "installed"
    workspace.package("xacro", **{"src/xacro/__init__.py": "here = 'workspace'"})
    assert workspace.shows(code) == "workspace"
    assert workspace.shows(code, ROS_PACKAGE_PATH="") == "installed"


def test_a_built_package_wins_over_the_sources_of_the_workspace(workspace: Workspace, tmp_path: Path) -> None:
    workspace.package("xacro", **{"src/xacro/__init__.py": "here = 'workspace'"})
    built = tmp_path / "devel" / "lib" / "python3" / "dist-packages"
    (built / "xacro").mkdir(parents=True)
    (built / "xacro" / "__init__.py").write_text("here = 'built'")
    assert workspace.shows("import xacro; print(xacro.here)", PYTHONPATH=str(built)) == "built"


def test_a_package_that_only_setup_py_declares_wins_over_an_installed_one(workspace: Workspace) -> None:
    setup = "generate_distutils_setup(packages=['xacro'], package_dir={'': 'python'})"
    workspace.package("xacro", **{"setup.py": setup, "python/xacro/__init__.py": "here = 'workspace'"})
    assert workspace.shows("import xacro; print(xacro.here)") == "workspace"


def test_a_package_without_python_does_not_hide_an_installed_one(workspace: Workspace) -> None:
    workspace.package("xacro", **{"msg/One.msg": "int8 x"})
    assert workspace.shows("import xacro; print(hasattr(xacro, 'process_file'))") == "True"


def test_the_package_may_be_in_a_repository_of_the_workspace(workspace: Workspace) -> None:
    package = workspace.package("xacro", **{"src/xacro/__init__.py": "here = 'workspace'"})
    repository = package.parent / "group" / "repository"
    repository.mkdir(parents=True)
    package.rename(repository / "xacro")
    assert workspace.shows("import xacro; print(xacro.here)") == "workspace"


def test_packages_are_not_searched_for_unless_a_folder_has_the_name_of_the_module(
    workspace: Workspace,
) -> None:
    workspace.package("robot", **{"src/robot/__init__.py": ""})
    code = "import pytest, sys; print([name for name in sys.modules if name.startswith('pipros.packages')])"
    assert workspace.shows(code) == "[]"
