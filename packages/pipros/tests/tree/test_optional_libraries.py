"""Whatever needs an optional library says so in one line, with the extra, where it is requested."""

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.basics.plugin_table import PLUGINS
from tests.support.environments import ROOTS, SHIPPED, SOURCE_PATH, files_below, import_path
from tests.support.project import EXTRAS
from tests.support.trees import nodes_of, parsed

# needs no library
_NAMES = """
    numpy cv2 PIL scipy pandas polars pyarrow duckdb av mcp PyKDL zenoh cryptography Cryptodome gnupg lz4
    zstandard xacro urdf_parser_py em serial ntplib netifaces rclpy uvloop setproctitle h5py torch lerobot
    bson cbor2 coverage gymnasium orjson psutil pydantic rerun rosdep2 uvicorn xxhash
"""
OPTIONAL = _NAMES.split()
"""Libraries that pipros does not depend on: those of its extras, and those that it uses if they are there."""

GUARDED = {
    "pipros_robot.navigation": "pipros_robot/navigation/programs.py",
    "pipros_data": "pipros_data/extras.py",
    "pipros_assistants": "pipros_assistants/commands/__init__.py",
}
"""Packages whose modules import libraries without `try`, and the file through which they are started."""

IMPORT_ALL = """
import importlib, json, runpy, sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in OPTIONAL:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

OPTIONAL, MODULES, SCRIPTS = json.loads(sys.stdin.read())
sys.meta_path.insert(0, Absent())
failed = {}
for name in MODULES:
    try:
        importlib.import_module(name)
    except Exception as error:
        failed[name] = f"{type(error).__name__}: {error}"

import pipros_tools.cli.entry_point as entry_point
entry_point.command = entry_point.program = lambda main: lambda *arguments: 0  # the program is not run
for script in SCRIPTS:
    try:
        runpy.run_path(script)
    except SystemExit:
        pass
    except BaseException as error:
        failed[script] = f"outside of `command`: {error}"
print(json.dumps(failed))
"""


def modules() -> Iterator[tuple[str, Path]]:
    for folder in ROOTS:
        for file in files_below(folder, "*.py"):
            path = import_path(file)
            if "share" not in path.parts and file.name != "__main__.py":
                yield ".".join(path.with_suffix("").parts).removesuffix(".__init__"), file


def imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []


def unguarded(node: ast.AST) -> Iterator[int]:
    """Yield the lines of imports of optional libraries inside of functions, but outside of `try`."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Try):
            for handler in (*child.handlers, *child.orelse, *child.finalbody):
                yield from unguarded(handler)
        elif any(name.partition(".")[0] in OPTIONAL for name in imported(child)):
            yield getattr(child, "lineno", 0)
        else:
            yield from unguarded(child)


def functions(tree: ast.Module) -> Iterator[ast.AST]:
    return (node for node in nodes_of(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))


@pytest.mark.timeout(300)
def test_functions_import_optional_libraries_inside_of_try_or_by_required() -> None:
    found = {
        f"{name}:{line}"
        for name, file in modules()
        for function in functions(parsed(file))
        for line in unguarded(function)
    }

    assert found == set(), "use pipros.basics.extras.required"


@pytest.mark.timeout(300)
def test_every_module_works_without_optional_libraries_or_names_the_extra() -> None:
    names = sorted(
        name for name, _ in modules() if not any(f"{name}.".startswith(f"{each}.") for each in GUARDED)
    )
    files = [file for share in SHIPPED for file in share.glob("*/scripts/*") if file.is_file()]
    scripts = [str(file) for file in files if b"entry_point import" in file.read_bytes()]
    assert min(len(names) / 1000, len(scripts) / 50) > 1

    ended = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL], input=json.dumps([OPTIONAL, names, scripts]),
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": SOURCE_PATH}, capture_output=True, text=True, check=False,
    )  # fmt: skip

    assert ended.returncode == 0, ended.stderr
    failed = json.loads(ended.stdout.splitlines()[-1])
    assert len(failed) < len(names) / 4
    assert [f"{name}: {text}" for name, text in failed.items() if not text.startswith("MissingExtra: ")] == []


ADVISORS = {"missing": 1, "required": 2, "install_command": 0}
"""Functions of `pipros.basics.extras`, and the index of their first argument that is an extra."""


@pytest.mark.timeout(300)
def test_the_extras_that_errors_name_exist() -> None:
    known = {*EXTRAS}
    known |= {plugin.distribution for plugin in PLUGINS.values()}
    known |= {f"{each.distribution}[{extra}]" for each in PLUGINS.values() for extra in each.extras.split()}
    named = {
        f"{argument.value} in {name}:{call.lineno}"
        for name, file in modules()
        for call in nodes_of(parsed(file))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in ADVISORS
        for argument in call.args[ADVISORS[call.func.id] :]
        if isinstance(argument, ast.Constant)
    }

    assert len(named) > 10
    assert {each for each in named if each.partition(" ")[0] not in known} == set()


SUBSCRIBE = "import rospy, std_msgs.msg; rospy.Subscriber('t', std_msgs.msg.String, zero_copy=True)"
NUMPY_MSG = "from rospy.numpy_msg import numpy_msg; from std_msgs.msg import String; numpy_msg(String)"
PCD = "from pipros_tools.cli.entry_point import program; raise SystemExit(program('{}')())"
AMCL = "from pipros_robot.navigation.programs import run_program as run; sys.exit(run('amcl.amcl_node'))"


@pytest.mark.timeout(300)
@pytest.mark.parametrize(("program", "what"), [
    (SUBSCRIBE, "zero_copy=True needs"), (NUMPY_MSG, "numpy_msg needs"),
    ("import cv_bridge", "images and cameras need"), ("import image_geometry", "images and cameras need"),
    ("import pipros_data; pipros_data.open_bags", "pipros_data needs"),
    (PCD.format("pipros_robot.perception.clouds.pcd_nodes:pcd_to_pointcloud"),
        "point clouds and laser scans need"),
    (AMCL, "this node needs"),
])  # fmt: skip
def test_what_needs_numpy_names_the_extra_in_one_line(program: str, what: str) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.modules['numpy'] = None; {program}"],
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": SOURCE_PATH}, capture_output=True, text=True, check=False,
    )  # fmt: skip

    last = ended.stderr.splitlines()[-1]
    assert ended.returncode == 1
    assert f"{what} numpy, which is not installed. Try: " in last
    assert "pip install" in last
