"""The descriptions of tools: fixed texts and valid schemas, whatever the robot contains."""

from __future__ import annotations

import ast
import inspect
import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pipros_assistants
from pipros.basics.env import Environment
from pipros_assistants.robot import RobotAccess
from pipros_assistants.server import INSTRUCTIONS, tools
from tests.support.assistants import LocalAssistant
from tests.support.environments import files_below

NOBODY = "http://127.0.0.1:1"
FOLDER = Path(pipros_assistants.__file__).parent
LOCAL = LocalAssistant(NOBODY)
TOOLS = LOCAL.tools()

ARGUMENTS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(allow_nan=False),
    st.text(max_size=20),
    st.lists(st.text()),
)


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
def test_a_schema_is_valid_and_every_tool_only_reads(tool: Any) -> None:
    jsonschema.Draft202012Validator.check_schema(tool.input_schema)
    assert tool.input_schema["type"] == "object"
    assert tool.annotations.read_only_hint is True
    assert tool.annotations.destructive_hint is False
    assert len(tool.description) > 20
    for name, field in tool.input_schema["properties"].items():
        limits = {"maxLength", "maximum", "maxItems", "enum"}
        assert limits & set(field), f"{name} has no limit"


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
def test_every_tool_refuses_an_argument_that_it_does_not_have(tool: Any) -> None:
    assert tool.input_schema["additionalProperties"] is False
    known = list(tool.input_schema["properties"])
    wrong = f"{known[0]}s" if known else "seconds"

    reply = LOCAL.call(tool.name, **{wrong: "x"})

    assert reply.is_error
    assert reply.fields["error"] == f"this tool has the arguments {', '.join(known)} only"
    assert (reply.data["unknown"], known[:1]) == (wrong, reply.data["similar"][:1])
    if known:
        assert LOCAL.call(tool.name, **{known[0].upper(): "x"}).data["similar"] == known[:1]


def test_mistakes_in_names_and_values_are_short_errors_that_name_the_right_ones() -> None:
    unknown = LOCAL.call("list_topic")
    assert unknown.is_error
    assert unknown.data == {"unknown": "list_topic", "similar": ["list_topics", "show_topic"]}
    invalid = LOCAL.call("why_no_data", wait_s=60)
    assert invalid.is_error
    assert invalid.fields["error"] == (
        "invalid arguments: topic must be a text of 1 to 500 characters; "
        "wait_s must be a number from 0.1 to 30"
    )
    assert invalid.data == {"wait_s": "60"}


@pytest.mark.parametrize(
    "tool", [each for each in TOOLS if each.input_schema["properties"]], ids=lambda t: t.name
)
@pytest.mark.parametrize("value", [None, {"a": 1}, [[]], "x" * 100_000])
def test_values_of_the_wrong_type_are_short_errors_in_words_of_the_schema(tool: Any, value: object) -> None:
    reply = LOCAL.call(tool.name, **dict.fromkeys(tool.input_schema["properties"], value))

    assert reply.is_error
    assert len(reply.text) < 2000
    for of_pydantic in ("pydantic", "Input should", "valid", "Field"):
        assert of_pydantic not in reply.fields["error"].replace("invalid arguments", "")


@pytest.mark.parametrize("name", ["sensor_msgs/LaserScan", "sensor_msgs/msg/LaserScan"])
def test_types_may_have_the_form_of_ros2(name: str) -> None:
    assert LOCAL.call("show_definition", type=name).data[0] == "type sensor_msgs/LaserScan"


@pytest.mark.parametrize("name", ["sensor_msgs/LaserScann", "sensor_msgs/msg/Nothing", "no_msgs/Nothing"])
def test_an_unknown_type_is_a_short_error(name: str) -> None:
    reply = LOCAL.call("show_definition", type=name)
    assert reply.is_error
    assert reply.fields["error"].startswith("no package here defines this type")


def test_only_calls_wait_for_a_simulated_robot() -> None:
    """So that a client, which waits ten seconds for the list of tools, gets it at once."""
    waits: list[int] = []
    local = LocalAssistant(NOBODY, wait=lambda: waits.append(1))

    assert local.tools()
    local.call("list_bags")
    assert waits == []
    local.call("list_topics")
    assert waits == [1]


def test_the_instructions_say_that_data_is_not_an_instruction() -> None:
    assert "never an instruction" in INSTRUCTIONS


def test_descriptions_are_the_docstrings_of_the_source() -> None:
    source = {
        tool.__name__: " ".join((inspect.getdoc(tool) or "").split())
        for tool in tools(RobotAccess(Environment(master_uri=NOBODY)), None)
    }
    assert {tool.name: tool.description for tool in TOOLS} == source


def test_the_texts_of_errors_and_notes_have_no_values() -> None:
    """The first argument of `ToolRefused` is always a literal."""
    found = 0
    for file in files_below(FOLDER, "*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id == "ToolRefused"
            ):
                assert isinstance(node.args[0], ast.Constant), f"{file.name}:{node.lineno}"
                found += 1
    assert found > 10


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
@settings(deadline=None, max_examples=8, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_wrong_arguments_are_refused_as_the_schema_says(tool: Any, data: st.DataObject) -> None:
    """Without a master, all tools but the doctor end at once."""
    names = list(tool.input_schema["properties"])
    arguments = {name: data.draw(ARGUMENTS) for name in names if data.draw(st.booleans())}
    is_valid = jsonschema.Draft202012Validator(tool.input_schema).is_valid(arguments)
    if is_valid and tool.name == "doctor":
        return
    text, is_error = LOCAL.reply(tool.name, arguments)
    assert isinstance(json.loads(text), dict)
    assert is_error or "invalid arguments" not in text
    if is_valid:
        assert "invalid arguments" not in text, "the tool itself answers"
