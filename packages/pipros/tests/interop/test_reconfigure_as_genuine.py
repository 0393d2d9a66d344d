"""dynamic_reconfigure between pipros and genuine ROS in either direction: the same traffic and responses."""

import json
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.reconfigure.cfg_file import module_contents, read
from tests.golden.test_roscpp_parameters import ROWS, value_of
from tests.support.environments import file_of_tests, genuine_environment
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.roscpp import compile_program
from tests.support.same_results import printed

PROGRAMS = Path(__file__).parent / "programs"
CFG = """
PACKAGE = "tuning"
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
constants = [gen.const("Small", int_t, 0, "A small one"), gen.const("Large", int_t, 2, "A large one")]
gen.add("size", int_t, 1, "How large", 0, 0, 2, edit_method=gen.enum(constants, "Sizes"))
gen.add("gain", double_t, 2, "A gain", 1.5, -10, 10)
gen.add("free", double_t, 4, "Without bounds", 1.0)
gen.add("name", str_t, 8, "A name", "robot")
gen.add("on", bool_t, 16, "Whether", True)
inner = gen.add_group("Inner", type="collapse", state=False)
inner.add("count", int_t, 32, "Inside", 5, 0, 9)
deep = inner.add_group("Deep one")
deep.add("flag", bool_t, 64, "Deeper", False)
exit(gen.generate(PACKAGE, "tuning", "Tuning"))
"""


@pytest.mark.parametrize("words", [(), ("frobnicate",), ("get",), ("set", "node")])
def test_wrong_command_lines_of_dynparam_exit_alike(plain_ros: RosSystem, words: tuple[str, ...]) -> None:
    codes = [
        side.run(*side.node("dynamic_reconfigure", "dynparam"), *words).returncode
        for side in (plain_ros.genuine, plain_ros.pipros)
    ]
    assert codes == [2 if words and words[0] != "frobnicate" else 1] * 2


def test_parameters_change_alike(plain_ros: RosSystem, tmp_path: Path) -> None:
    file = tmp_path / "Tuning.cfg"
    file.write_text(CFG)
    module = tmp_path / "module.json"
    module.write_text(json.dumps(module_contents(read(file))))
    plain_ros.serve_master()
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}
    seen = {}
    for server in sides:
        for client in sides:
            serving = sides[server].start("python3", PROGRAMS / "serve_parameters.py", module)
            asking = sides[client].run("python3", PROGRAMS / "change_parameters.py", timeout_s=90)
            serving.press_ctrl_c()
            serving.wait()
            assert asking.returncode == 0, asking.output
            seen[server, client] = (asking.stdout, serving.stdout)

    expected = seen["genuine", "genuine"]
    assert len(expected[0]) == 12
    for pair, found in seen.items():
        # The texts of the two errors are our own.
        differing = [
            (a, b) for a, b in zip(found[0], expected[0], strict=True) if a != b and "param" not in a
        ]
        assert differing == [], pair
        assert found[1] == expected[1], pair


def test_settings_of_a_node_in_cpp_are_read_and_changed(plain_ros: RosSystem) -> None:
    """image_proc is a client of pipros's master and parameters, and pipros one of its settings."""
    ros = plain_ros
    ros.serve_master()
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/camera/debayer", {"debayer": 1})
        nodelet = ros.genuine.start(
            "/usr/lib/nodelet/nodelet", "standalone", "image_proc/debayer", "__name:=debayer", "__ns:=/camera"
        )
        ros.wait_for_publisher("/camera/debayer/parameter_descriptions")
        description: Any = load_message_class("dynamic_reconfigure/ConfigDescription")
        inbox = Inbox.of(node, "/camera/debayer/parameter_descriptions", description)
        (group,) = inbox.wait()[0].groups
        dynparam = ["rosrun", "dynamic_reconfigure", "dynparam"]
        first, changed, second = (
            ros.pipros.run(*dynparam, *words)
            for words in (
                ("get", "/camera/debayer"), ("set", "/camera/debayer", "debayer", "3"),
                ("get", "/camera/debayer"),
            )
        )  # fmt: skip

        assert [(each.name, each.type) for each in group.parameters] == [("debayer", "int")]
        assert changed.returncode == 0, changed.output + nodelet.output
        assert ["'debayer': 1" in first.output, "'debayer': 3" in second.output] == [True, True], (
            second.output
        )
        assert node.params.get("/camera/debayer/debayer") == 3


# The recorded answers of roscpp, with which all readers of parameters are compared, are those of roscpp.
def test_roscpp_converts_parameters_as_recorded(ros: RosSystem) -> None:
    program = compile_program(file_of_tests("golden/roscpp_parameters.cpp"))
    ros.serve_master()
    with Node("setter", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/rows", {f"r{index}": value_of(row) for index, row in enumerate(ROWS)})
    environment = genuine_environment(ros.home, ros.master_uri)
    answers = [json.loads(line) for line in printed(program, environment=environment).splitlines()]
    assert answers == [{kind: row[kind] for kind in row if kind != "value"} for row in ROWS]
