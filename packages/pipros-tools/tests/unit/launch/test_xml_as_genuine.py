"""The XML language, case by case, compared with the outcome in genuine roslaunch.

`cases.txt` holds launch files of one line; `@a:=1 …` gives arguments, `#…` a file without the usual
`<launch>` around it. `genuine.jsonl` was captured by `tests.interop.programs.genuine_launch_loader`.
"""

import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import NotFound
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import NODE_SETTINGS, Launch, LaunchError, LaunchNode, Output, WorkingFolder
from pipros_tools.launch.xml import load
from tests.support.environments import file_of_tests

FOLDER = file_of_tests("golden/launch_language")
GENUINE = [json.loads(line) for line in (FOLDER / "genuine.jsonl").read_text().splitlines()]

# Deliberate differences, with their reasons.
REFUSED_HERE = {'<group ns="/" clear_params="true"/>': "it would delete every parameter there is"}
DIFFERENT_HERE = {
    '<rosparam>{"~p": 1}</rosparam>': "genuine sets a parameter that is literally named ~p",
    '<rosparam ns="~x">5</rosparam>': "likewise",
    '<rosparam ns="~x">{a: 5}</rosparam>': "likewise",
    '<rosparam param="~p">1</rosparam><node pkg="p" type="t" name="n"/>': "likewise",
    '<node pkg="p" type="t" name="n"><rosparam param="~a">1</rosparam></node>': "likewise",
    '<rosparam file="$(dirname)/p.yaml" command="load" param="~k"/>': "likewise",
    '<rosparam ns="x">{~a: 1}</rosparam><node pkg="p" type="t" name="n"/>': "likewise",
    '<node pkg="p" type="t" name="n"><rosparam ns="x">{~a: 1}</rosparam></node>': "likewise",
    '<node pkg="p" type="t" name="n"><rosparam ns="~">{a: 1}</rosparam></node>': "likewise",
    '<node pkg="p" type="t" name="n"><rosparam command="delete" param="~a"/></node>': "likewise",
    '<arg name="e" value="$(eval 1 + 1)"/><param name="p" value="$(eval e * 2)"/>'
    """<param name="q" value="$(eval 'a' + str(e))"/>""": "genuine's math.e hides the argument",
}

_PRINT = "import sys; sys.stdout.reconfigure(newline=''); print(*sys.argv[1:])"
ECHO = f'"{Path(sys.executable).as_posix()}" -c "{_PRINT}" '
"""A program that Windows has, too."""

_ANONYMOUS = re.compile(r"_\w+_\d+_\d{6,}")


def sorted_text(outcome: dict[str, Any]) -> str:
    return _ANONYMOUS.sub("_", json.dumps(outcome, sort_keys=True))


def plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return ["bytes", value.decode("latin-1")]
    if isinstance(value, dict):
        return ["dict", {str(key): plain(part) for key, part in value.items()}]
    return [type(value).__name__, repr(value)]


def fields(node: LaunchNode) -> dict[str, Any]:
    plain = [each.field for each in NODE_SETTINGS if each.library and not each.choices]
    return {
        **{name: getattr(node, name) or "" for name in plain},
        "output": (node.output or Output.LOG).value,
        "cwd": (node.working_folder or WorkingFolder.ROS_HOME).value,
        "remappings": [list(pair) for pair in node.remappings],
        "environment": [list(pair) for pair in node.environment],
    }


def described(launch: Launch) -> dict[str, Any]:
    return {
        "params": {key: plain(value) for key, value in sorted(launch.params.items())},
        "clear_params": sorted(launch.clear_params),
        "commands": [
            ["rosparam", "dump", command.file or None, command.key]
            if command.action.value == "dump"
            else ["rosparam", "delete", command.key]
            for command in launch.commands
        ],
        "nodes": [fields(node) for node in launch.nodes],
        "tests": [
            {
                **fields(test.node),
                "test_name": test.test_name,
                "time_limit_s": test.time_limit_s,
                "retry": test.retry,
            }
            for test in launch.tests
        ],
        "machines": sorted(launch.machines),
    }


def load_case(case: str, folder: Path) -> Launch:
    arguments: dict[str, str] = {}
    if case.startswith("@"):
        given, case = case[1:].split(" ", 1)
        arguments = dict(pair.split(":=") for pair in given.split(","))
    path = folder / "case.launch"
    path.write_text(case[1:] if case.startswith("#") else f"<launch>{case}</launch>", encoding="utf-8")

    def find(package: str, path: str) -> str:
        raise NotFound(f"package [{package}] not found")

    here = LoadContext.of_process()

    def run(command: str) -> str:
        return here.run_command(re.sub("^echo ", ECHO, command))

    context = LoadContext(find, {}, here.make_anonymous, here.read_file, run)
    return load([str(path)], arguments, context=context)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for file in (FOLDER / "files").iterdir():
        shutil.copy(file, tmp_path)
    return tmp_path


@pytest.mark.parametrize("outcome", GENUINE, ids=[row["case"] for row in GENUINE])
def test_each_case_has_the_outcome_of_genuine_roslaunch(outcome: dict[str, Any], folder: Path) -> None:
    case, genuine = outcome["case"], outcome["genuine"]
    if case in REFUSED_HERE or "error" in genuine:
        with pytest.raises(LaunchError):
            load_case(case, folder)
        return
    if case in DIFFERENT_HERE:
        load_case(case, folder)
        return
    launch = load_case(case, folder)
    written = json.dumps(repr(str(folder)))[2:-2]
    ours = json.loads(json.dumps(described(launch)).replace(written, "{folder}"))
    warned = genuine.pop("warnings")
    assert sorted_text(ours) == sorted_text(genuine)
    assert len(launch.warnings) >= warned


@pytest.mark.parametrize(("rosparam", "found"), [
    ('<rosparam ns="~p">{a: 1}</rosparam>', {"/g/n/p/a": 1}),
    ('<rosparam ns="/x">{~a: 1, b: {~c: 2}}</rosparam>', {"/g/n/a": 1, "/g/n/c": 2}),
    ('<rosparam ns="x" param="~a">1</rosparam>', {"/g/n/a": 1}),
    ('<rosparam param="~">{a: 1}</rosparam>', {"/g/n/a": 1}),
    ('<rosparam>{~/a: 1, "~": 2}</rosparam>', {"/g/n/a": 1, "/g/n": 2}),
])  # fmt: skip
@pytest.mark.parametrize("where", ["before", "inside"])
def test_private_names_of_rosparam_belong_to_nodes(
    rosparam: str, found: dict[str, Any], where: str, folder: Path
) -> None:
    before, inside = (rosparam, "") if where == "before" else ("", rosparam)
    node = f'<node pkg="p" type="t" name="n">{inside}</node>'

    launch = load_case(f'<group ns="g">{before}{node}</group>', folder)

    assert (launch.params, launch.warnings) == (found, ())


@pytest.mark.parametrize("action", ["dump", "delete"])
def test_private_parameters_of_a_node_are_dumped_and_deleted(action: str, folder: Path) -> None:
    case = f'<node pkg="p" type="t" name="n"><rosparam command="{action}" param="~a" ns="x"/></node>'

    assert [command.key for command in load_case(case, folder).commands] == ["/n/a"]


@pytest.mark.parametrize("element", [
    '<param name="~a" value="1"/>', "<rosparam>{~a: 1}</rosparam>", '<rosparam param="~a">1</rosparam>'
])  # fmt: skip
def test_private_parameters_without_a_later_node_are_named(element: str, folder: Path) -> None:
    node = '<node pkg="p" type="t" name="n"/>'

    (warning,) = load_case(f"{node}<group>{element}</group>", folder).warnings

    assert warning.startswith("parameter [~a] in ")
    assert "is set for no node" in warning
    assert load_case(f"<group>{element}{node}</group>", folder).warnings == ()
