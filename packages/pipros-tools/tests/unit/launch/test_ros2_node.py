"""Scripts for rclpy in launch files: arguments, and the Python that runs them."""

import math
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from pipros.packages import nodelets
from pipros_tools.launch import ros2_node
from pipros_tools.launch.command import CannotLaunch, CommandMaker
from pipros_tools.launch.model import Launch, LaunchNode
from pipros_tools.launch.nodelet_choice import arguments_of, why_not_loadable, with_choices
from pipros_tools.launch.ros2_node import ros2_arguments
from pipros_workspace.client_library import relayed_script
from pipros_workspace.index import PackageIndex
from tests.support.debian_system import make_debian


@pytest.fixture
def script(tmp_path: Path) -> Path:
    program = tmp_path / "src" / "talkers" / "talker.py"
    program.parent.mkdir(parents=True)
    (program.parent / "package.xml").write_text("<package><name>talkers</name></package>")
    program.write_text("#!/usr/bin/env python3\nimport rclpy\n")
    program.chmod(0o755)
    return program


@pytest.fixture
def maker(tmp_path: Path, script: Path) -> CommandMaker:
    return CommandMaker(PackageIndex([tmp_path / "src"]), {"PATH": "/bin"}, tmp_path / "home")


def values(params: dict[str, Any]) -> list[str]:
    words = ros2_arguments(LaunchNode("p", "t", "n"), params)
    return [word for flag, word in pairwise(words) if flag == "-p"]


def test_name_namespace_and_remappings_become_arguments() -> None:
    node = LaunchNode("p", "t", "n", namespace="/a/b/", remappings=(("x", "/y"), ("~z", "w")))
    assert ros2_arguments(node, {}) == [
        "--ros-args", "-r", "__node:=n", "-r", "__ns:=/a/b", "-r", "x:=/y", "-r", "~z:=w",
    ]  # fmt: skip


@pytest.mark.parametrize(("value", "text"), [
    (True, "true"), (3, "3"), (3.0, "3.0"), (math.inf, ".inf"), (-math.inf, "-.inf"), (math.nan, ".nan"),
    ("3", '"3"'), ("on: ü", '"on: ü"'), ([1, 2], "[1, 2]"), ([1, 2.5], "[1.0, 2.5]"),
    (["a", "b c"], '["a", "b c"]'), ([], "[]"),
])  # fmt: skip
def test_values_keep_their_types(value: Any, text: str) -> None:
    assert values({"/n/x": value}) == [f"x:={text}"]


def test_only_the_nodes_own_parameters_are_given_with_dots_for_slashes() -> None:
    params = {
        "/n/gains": {"p": 1, "deep": {"i": 2}}, "/n/a/b": 3, "/other": 4, "/nn/x": 5, "/n": {"whole": 6},
    }  # fmt: skip
    assert values(params) == ["gains.p:=1", "gains.deep.i:=2", "a.b:=3", "whole:=6"]


def test_simulated_time_is_the_nodes_own() -> None:
    assert values({"/use_sim_time": True}) == ["use_sim_time:=true"]
    assert values({"/use_sim_time": True, "/n/use_sim_time": False}) == ["use_sim_time:=false"]


@pytest.mark.parametrize("value", [[1, "a"], [True, 1], [[1]], b"x", None])
def test_a_value_that_ros2_lacks_is_refused_by_name(value: Any, maker: CommandMaker) -> None:
    with pytest.raises(CannotLaunch, match=r"talkers/talker.py.*value of ~x: it must be a truth value"):
        maker.make(LaunchNode("talkers", "talker.py", "n"), "http://m:1", params={"/n/x": value})


def test_the_named_python_runs_the_script(maker: CommandMaker, script: Path) -> None:
    node = LaunchNode("talkers", "talker.py", "n", arguments="--fast", ros2_python=sys.executable)
    command = maker.make(node, "http://m:1", log_stem="/log/n-1", params={"/n/rate": 5})
    assert command.argv == (
        sys.executable, str(script), "--fast", "--ros-args", "-r", "__node:=n", "-p", "rate:=5",
    )  # fmt: skip


def test_a_python_that_cannot_be_run_is_named(maker: CommandMaker) -> None:
    node = LaunchNode("talkers", "talker.py", "n", ros2_python="/no/python")
    with pytest.raises(CannotLaunch, match=r"ros2_python names \[/no/python\], which cannot be run"):
        maker.make(node, "http://m:1")


@pytest.mark.needs("executable files")
def test_the_python_of_the_first_line_runs_the_script(maker: CommandMaker, script: Path) -> None:
    script.write_text("#!/bin/python3\nimport rclpy\n")
    assert maker.make(LaunchNode("talkers", "talker.py", "n"), "http://m:1").argv[0] == str(script)


def test_without_rclpy_advice_names_the_ways_to_have_it(maker, script: Path, monkeypatch) -> None:
    monkeypatch.setattr(ros2_node, "find_spec", lambda _: None)
    with pytest.raises(CannotLaunch, match=r"imports rclpy, which this Python lacks.*ros2_python:=\.\.\."):
        maker.make(LaunchNode("talkers", "talker.py", "n"), "http://m:1")
    monkeypatch.setattr(ros2_node, "find_spec", lambda _: object())
    assert "--ros-args" in maker.make(LaunchNode("talkers", "talker.py", "n"), "http://m:1").argv


def test_a_script_in_a_devel_space_leads_to_its_source(tmp_path, maker: CommandMaker, script: Path) -> None:
    source = tmp_path / "source.py"
    source.write_bytes(script.read_bytes())
    source.chmod(0o755)
    script.write_text(f"#!/usr/bin/env python3\nscript = {str(source)!r}\n")
    node = LaunchNode("talkers", "talker.py", "n", ros2_python=sys.executable)
    assert maker.make(node, "http://m:1").argv[:2] == (sys.executable, str(source))


def test_on_windows_the_first_line_does_not_choose_the_python(maker, script: Path, monkeypatch) -> None:
    for module in ("pipros_tools.launch.command", "pipros_workspace.program_start"):
        monkeypatch.setattr(f"{module}.ON_WINDOWS", True)
    monkeypatch.setattr(ros2_node, "find_spec", lambda _: None)
    script.write_bytes(b"#!/opt/none/python3\r\nimport rclpy\r\n")
    with pytest.raises(CannotLaunch, match="imports rclpy, which this Python lacks"):
        maker.make(LaunchNode("talkers", "talker.py", "n"), "http://m:1")


@pytest.mark.parametrize("path", [r"C:\ws\talker.py", r"\\lab\ws\it's.py", "/ws/talker.py"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_relayed_script_may_have_a_path_and_line_ends_of_windows(path: str, end: str, tmp_path) -> None:
    relay = tmp_path / "talker.py"
    relay.write_bytes(f"#!/usr/bin/env python3{end}script = {path!r}{end}".encode())
    assert relayed_script(relay) == Path(path)


def test_a_script_with_both_libraries_has_the_arguments_of_ros1(maker: CommandMaker, script: Path) -> None:
    script.write_text("#!/usr/bin/env python3\nimport rclpy\nimport rospy\n")
    assert "__name:=n" in maker.make(LaunchNode("talkers", "talker.py", "n"), "http://m:1").argv


COMPILED = {"image_proc/debayer": "image_proc", "only_cpp/C": "only_cpp"}
"""Plugins in C++. The first is also in Python, as is `image_proc/rectify`."""


def nodelet(name: str, arguments: str, **fields: object) -> LaunchNode:
    return LaunchNode("nodelet", "nodelet", name, arguments=arguments, **fields)  # type: ignore[arg-type]


def chosen_for(*plugins: str, compiled: dict[str, str] = COMPILED, **variables: str) -> tuple[set[str], str]:
    """Return the values of the variable, and the log, for a manager with nodelets."""
    loads = [nodelet(f"n{at}", f"load {plugin} m", namespace="/r/") for at, plugin in enumerate(plugins)]
    launch = Launch(nodes=(nodelet("m", "manager", namespace="/r/"), *loads, LaunchNode("a", "b", "other")))
    changed, lines = with_choices(launch, lambda: compiled, variables)
    *ours, other = [dict(node.environment).get("PIPROS_NODELETS", "") for node in changed.nodes]
    assert other == ""
    return set(ours), "\n".join(lines)


def test_a_manager_is_in_python_if_all_its_nodelets_are() -> None:
    assert chosen_for("image_proc/debayer", "image_proc/rectify") == (
        {""},
        "nodelet /r/n0 (image_proc/debayer) runs in Python\n"
        "nodelet /r/n1 (image_proc/rectify) runs in Python",
    )


def test_a_manager_is_genuine_if_one_of_its_nodelets_is_only_in_cpp() -> None:
    assert chosen_for("image_proc/debayer", "only_cpp/C") == ({"genuine"}, "")


def test_a_manager_whose_nodelets_are_not_all_installed_is_in_python() -> None:
    expected = {"ours"}, "nodelet /r/n0 (image_proc/debayer) runs in Python"
    assert chosen_for("image_proc/debayer", "only_cpp/C", compiled={}) == expected
    assert chosen_for("image_proc/rectify", "only_cpp/C")[0] == {"ours"}


def test_the_variable_overrides_the_choice() -> None:
    assert chosen_for("image_proc/debayer", PIPROS_NODELETS="genuine") == ({"genuine"}, "")
    assert chosen_for("image_proc/debayer", "only_cpp/C", PIPROS_NODELETS="ours")[0] == {"ours"}


def test_arguments_name_the_manager_in_the_namespace_of_the_loader() -> None:
    in_group = arguments_of(nodelet("n", "load a/B m --no-bond", namespace="/r/"))
    assert in_group.manager == "/r/m"
    absolute = arguments_of(nodelet("n", "load a/B /m", namespace="/r/"))
    assert absolute.manager == "/m"
    assert arguments_of(nodelet("n", "'open")) is None
    assert arguments_of(LaunchNode("a", "nodelet", "n", arguments="manager")) is None


def test_a_nodelet_that_nothing_can_load_is_explained(tmp_path: Path, monkeypatch) -> None:
    debian = make_debian(tmp_path / "debian", monkeypatch)
    load = nodelet("n", "load pcl/Nothing m")
    assert "The nodelet pcl/Nothing is a C++ plugin" in str(why_not_loadable(load, {}))
    assert "must be ours or genuine" in str(why_not_loadable(load, {"PIPROS_NODELETS": "both"}))
    assert why_not_loadable(load, {"PIPROS_NODELETS": "genuine"}) is None
    assert why_not_loadable(nodelet("m", "manager"), {}) is None
    assert why_not_loadable(nodelet("n", "standalone image_proc/debayer"), {}) is None

    package = debian.share / "my_nodelets"
    package.mkdir()
    (package / "package.xml").write_text(
        '<package><name>my_nodelets</name><export><nodelet plugin="${prefix}/all.xml"/></export></package>'
    )
    (package / "all.xml").write_text(
        '<?xml version="1.0"?>\n<library path="lib"><class name="pcl/Nothing" type="x"/></library>\n'
        '<class_libraries><library><class type="b/Unnamed"/></library></class_libraries>'
    )
    assert nodelets.compiled_nodelets() == {"pcl/Nothing": "my_nodelets", "b/Unnamed": "my_nodelets"}
    assert why_not_loadable(load, {}) is not None  # the program is not installed
    program = debian.lib / "nodelet" / "nodelet"
    program.parent.mkdir()
    program.touch(0o755)
    assert why_not_loadable(load, {}) is None
    assert "its manager is in Python" in str(why_not_loadable(load, {"PIPROS_NODELETS": "ours"}))
