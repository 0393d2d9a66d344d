"""The descriptions of tools: fixed texts and valid schemas, whatever the robot contains."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pipros.assistants
from pipros.assistants.robot import RobotAccess
from pipros.assistants.server import INSTRUCTIONS, tools
from pipros.basics.env import Environment
from tests.support.assistants import LocalAssistant
from tests.support.environments import files_below

NOBODY = "http://127.0.0.1:1"
FOLDER = Path(pipros.assistants.__file__).parent
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
    if is_valid:
        assert text.startswith("{"), "the tool itself answers"
    elif not text.startswith("{"):
        assert is_error
        assert text.startswith(f"Error executing tool {tool.name}: ")
