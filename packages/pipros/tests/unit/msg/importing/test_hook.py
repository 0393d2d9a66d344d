"""Importing messages straight from definition files, each in a fresh Python process."""

import json
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.support.environments import REPOSITORY, ROOTS

AT_START = "['pipros', 'pipros.msg', 'pipros.msg.importing', 'pipros.msg.importing.hook', 'pipros.startup']"
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

    def run(self, code: str, asked: str = "", **variables: str) -> subprocess.CompletedProcess[str]:
        environment = {
            key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "PYTHON"))
        }
        environment |= {"ROS_PACKAGE_PATH": str(self.source), "ROS_HOME": str(self.home), **variables}
        return subprocess.run(
            [self.python, "-c", code], cwd=self.working_folder, env=environment, input=asked,
            capture_output=True, text=True,
        )  # fmt: skip

    def shows(self, code: str, asked: str = "", **variables: str) -> str:
        result = self.run(code, asked, **variables)
        assert result.returncode == 0, result.stderr
        return result.stdout.strip()

    def fails(self, code: str) -> str:
        result = self.run(code)
        assert result.returncode == 1
        return result.stderr.strip().splitlines()[-1]


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


SETUP = "from setuptools import setup\nsetup(packages=['{0}'], package_dir={{'': 'python'}})\n"
FILES = {
    "arms/msg/Arm.msg": "Hand left\nHand right", "arms/msg/Hand.msg": "int8[5] fingers",
    "first/msg/A.msg": "std_msgs/Header h\nsecond/B b", "second/msg/B.msg": "geometry_msgs/Point[] points",
    "asked/srv/Ask.srv": "string what\n---\nint32 answer",
    "walker/action/Walk.action": "float32 far\n---\n---\nfloat32 done", "tooled/msg/A.msg": "int32 x",
    "tooled/src/tooled/__init__.py": "",
    "tooled/src/tooled/tools.py": "from tooled.msg import A\nmade = A(3)", "starred/msg/A.msg": "int32 x",
    "starred/msg/B.msg": "A a", "starred/srv/S.srv": "---", "outer/srv/Ask.srv": "---\nmiddle/B[] b",
    "outer/srv/No.srv": "---", "middle/msg/B.msg": "inner/C c", "inner/msg/C.msg": "string struct",
    "clashing/msg/struct.msg": "int32 x", "clashing/msg/B.msg": "int32 x",
    "single/msg/A.msg": "std_msgs/Header header", "broken/msg/A.msg": "int32 x",
    "broken/msg/B.msg": "int32 x\n\nint32 a b", "embedding/msg/A.msg": "no_such_package/B b",
    "driver/setup.py": SETUP.format("robot_lib"),
    "driver/python/robot_lib/__init__.py": "from robot_lib.arm import REACH\n",
    "driver/python/robot_lib/arm.py": "REACH = 3\n", "driven/setup.py": SETUP.format("driven"),
    "driven/python/driven/__init__.py": "WORD = 1\n", "driven/msg/A.msg": "int32 x",
    "unnamed/setup.py": SETUP.format("other"), "unnamed/python/lib/__init__.py": "",
}  # fmt: skip
QUESTIONS = """
a package of definitions is a Python package:
  from arms.msg import Arm, Hand; print(Arm(left=Hand([1] * 5)).left.fingers)
  [1, 1, 1, 1, 1]

messages may embed those of other packages:
  from first.msg import A; from second.msg import B; print(type(A().b) is B, A().b.points)
  True []

services have their halves:
  from asked.srv import Ask, AskRequest as Q, AskResponse as R; print(Ask._request_class is Q, R(42))
  True answer: 42

actions are messages:
  from walker.msg import WalkAction, WalkGoal; print(WalkGoal(2.5), WalkAction.__slots__)
  far: 2.5 ['action_goal', 'action_result', 'action_feedback']

a package may have modules and messages:
  from tooled.tools import made; print(made)
  x: 3

a star import gives all types:
  from starred.msg import *; from starred.srv import *; print(A, B, SRequest)
  …starred.msg._A.A…starred.msg._B.B…SRequest…

a star import gives the modules that generated code imports:
  from outer.srv import *; print(genpy.Time(), struct.pack, middle.msg.B(), inner.msg.C, sys, codecs, python3)
  0 <built-in function pack> c:…

a star import does not give the package:
  from outer.srv import *; print(genpy.Time(), struct.pack, middle.msg.B(), inner.msg.C, outer)
  NameError: name 'outer' is not defined

a message type wins over a module of its name:
  from clashing.msg import *; print(struct(1), B(2), genpy.__name__)
  x: 1 x: 2 genpy

modules of single types have the names of generated code:
  import single.msg._A as a; print(a.genpy.__name__, hasattr(a, 'nothing'))
  genpy False

a star import of a single type, too:
  from single.msg._A import *; print(A.__name__, std_msgs.msg.Header._type)
  A std_msgs/Header

dir lists the names for editors:
  import broken.msg as m; print([n for n in dir(m) if n[0] != '_'])
  ['A', 'B']

a mistake does not matter before the type is used:
  from broken.msg import A; print(A())
  x: 0

a mistake is found when the type is first used:
  from broken.msg import B
  …language.spec.DefinitionError: src/broken/msg/B.msg:3:1: expected a type and a name, got [int32 a b]

an unknown name is an import error:
  from single.msg import C
  ImportError: cannot import name 'C' from 'single.msg'…

an unknown package:
  import no_robot
  ModuleNotFoundError: No module named 'no_robot'

messages of an unknown package:
  from no_robot.srv import A
  …No module named 'no_robot': ROS_PACKAGE_PATH is …; is devel/setup.bash of its workspace sourced?

a kind that the package lacks:
  import single.srv
  ModuleNotFoundError: No module named 'single.srv'

an unknown embedded type is named with the field that uses it:
  from embedding.msg import A
  …language.spec.UnknownType: src/embedding/msg/A.msg:1:1: unknown type [no_such_package/B]…_PACKAGE_PATH is…

classes are found by type name:
  from pipros.msg import load_message_class as load; from single.msg import A; print(load('single/A') is A)
  True

an unknown type of a package:
  from pipros.msg import load_message_class as load; load('single/B')
  pipros.basics.errors.NotFound: there is no …

a type of an unknown package:
  from pipros.msg import load_message_class as load; load('no_robot/A')
  pipros.basics.errors.NotFound: there is no …

modules are importable from the folders of a setup.py:
  import driven, robot_lib.arm; from driven.msg import A; print(driven.WORD, robot_lib.REACH, A._type)
  1 3 driven/A

a module that no setup.py names is not found:
  import lib
  …No module named 'lib'…
"""
"""Each promise, the program that asks for it, and what it prints, or the last line of its error."""
ANSWERS = {
    promise.rstrip(":"): (code.strip(), printed.strip())
    for promise, code, printed in (each.split("\n") for each in QUESTIONS.strip().split("\n\n"))
}
ASK_ALL = """
import contextlib, io, json, sys, traceback
answers = {}
for name, code in json.load(sys.stdin).items():
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed):
            exec(code, {})
        answers[name] = printed.getvalue()
    except Exception as error:
        answers[name] = traceback.format_exception_only(error)[-1]
print(json.dumps(answers))
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What the programs in `QUESTIONS` print, or the last lines of their errors."""
    workspace = Workspace(tmp_path_factory.mktemp("workspace"))
    for package in {path.partition("/")[0] for path in FILES}:
        start = f"{package}/"
        workspace.package(package, **{p.removeprefix(start): FILES[p] for p in FILES if p.startswith(start)})
    asked = json.dumps({name: code for name, (code, _) in ANSWERS.items()})
    printed: dict[str, str] = json.loads(workspace.shows(ASK_ALL, asked))
    return {name: text.strip().replace(str(workspace.source), "src") for name, text in printed.items()}


@pytest.mark.parametrize("promise", ANSWERS)
def test_messages_and_modules_come_from_definition_files(promise: str, answers: dict[str, str]) -> None:
    pattern = ".*".join(map(re.escape, ANSWERS[promise][1].split("…")))
    assert re.fullmatch(pattern, answers[promise], re.DOTALL), answers[promise]


def test_included_messages_are_importable_without_a_package_path(workspace: Workspace) -> None:
    code = "from std_msgs.msg import String; from std_srvs.srv import Empty; print(String('hi'), Empty._type)"
    assert workspace.shows(code, ROS_PACKAGE_PATH="") == 'data: "hi" std_srvs/Empty'


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


def test_classes_are_in_the_modules_of_genpy_so_that_pickles_are_portable(workspace: Workspace) -> None:
    from std_msgs.msg import String

    assert String.__module__ == "std_msgs.msg._String"
    code = f"import pickle; print(pickle.loads({pickle.dumps(String('hi'))!r}))"
    assert workspace.shows(code, ROS_PACKAGE_PATH="") == 'data: "hi"'


def test_the_start_of_python_imports_only_a_few_modules(workspace: Workspace) -> None:
    assert workspace.shows(IMPORTED) == AT_START


PYTHONS = [path for path in ("/usr/bin/python3", sys.executable) if is_new_enough(path)]


@pytest.fixture(scope="module", params=PYTHONS)
def environment_of_its_own(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with pipros: of Debian's Python with its `sitecustomize`, and of this one."""
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([request.param, "-m", "venv", "--without-pip", folder], check=True)
    (site_packages,) = folder.glob("lib/python*/site-packages")
    folders = "\n".join(map(str, ROOTS))
    hook = (REPOSITORY / "packages/pipros/pipros.pth").read_text()
    (site_packages / "pipros.pth").write_text(f"{folders}\n{hook}")
    return folder / "bin" / "python"


def test_no_package_is_searched_at_the_start_of_python(workspace, environment_of_its_own: Path) -> None:
    (workspace.working_folder / "sitecustomize.py").write_text(
        "try:\n    import no_such_module\nexcept ImportError:\n    tried = True\n"
    )
    workspace.python = environment_of_its_own
    assert workspace.shows(IMPORTED) == AT_START
    customized = f"{IMPORTED}; import sitecustomize; assert sitecustomize.tried"
    assert workspace.shows(customized, PYTHONPATH=str(workspace.working_folder)) == AT_START


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


def test_a_package_without_python_does_not_hide_an_installed_one(workspace: Workspace) -> None:
    workspace.package("xacro", **{"msg/One.msg": "int8 x"})
    assert workspace.shows("import xacro; print(hasattr(xacro, 'process_file'))") == "True"


def test_packages_are_not_searched_for_unless_a_folder_has_the_name_of_the_module(workspace) -> None:
    workspace.package("robot", **{"src/robot/__init__.py": ""})
    code = "import pytest, sys; print([name for name in sys.modules if name.startswith('pipros.packages')])"
    assert workspace.shows(code) == "[]"
