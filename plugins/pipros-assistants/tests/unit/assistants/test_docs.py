"""guides/assistants.md: the configuration files follow our schemas for the clients, and the tools exist."""

import inspect
import json
import re
from typing import Any

import jsonschema

from pipros_assistants.commands import mcp
from pipros_assistants.tools.acts import ActTools
from tests.support import documents
from tests.support.assistants import LocalAssistant

PAGE = documents.text_of("guides/assistants.md")
BLOCKS = dict(re.findall(r'```json title="([^"]+)"\n(.*?)```', PAGE, re.DOTALL))

_SERVER: dict[str, Any] = {
    "type": "object", "required": ["command"], "additionalProperties": False,
    "properties": {"command": {"type": "string", "minLength": 1},
        "args": {"type": "array", "items": {"type": "string"}},
        "env": {"type": "object", "additionalProperties": {"type": "string"}}},
}  # fmt: skip


def schema(key: str, more: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a file with servers that are started, with the documented fields only."""
    server = {**_SERVER, "properties": {**_SERVER["properties"], **more}}
    servers = {"type": "object", "minProperties": 1, "additionalProperties": server}
    return {"type": "object", "required": [key], "additionalProperties": False, "properties": {key: servers}}


SCHEMAS = {
    "claude_desktop_config.json": schema("mcpServers", {}),
    "mcp.json": schema("servers", {"type": {"const": "stdio"}, "cwd": {"type": "string"}}),
    "settings.json": schema("mcpServers", {"trust": {"type": "boolean"}, "timeout": {"type": "integer"}}),
}


def test_the_files_of_three_clients_follow_their_schemas() -> None:
    assert BLOCKS.keys() == SCHEMAS.keys()
    for name, text in BLOCKS.items():
        jsonschema.validate(json.loads(text), SCHEMAS[name])


def test_the_file_of_the_task_follows_the_schema_of_its_client() -> None:
    (text,) = re.findall(r"```json\n(.*?)```", documents.text_of("how/assistant.md"), re.DOTALL)
    jsonschema.validate(json.loads(text), SCHEMAS["claude_desktop_config.json"])


def test_the_command_in_the_files_has_valid_arguments(monkeypatch: Any) -> None:
    served: list[Any] = []
    monkeypatch.setattr(mcp, "_serve", lambda options: served.append(options) or 0)
    for text in BLOCKS.values():
        [servers] = json.loads(text).values()
        command, *arguments = servers["robot"]["args"]
        assert command == "mcp"
        assert mcp.main(arguments) == 0
    assert [str(options.bags) for options in served] == ["/home/me/bags"] * 3


def test_every_tool_that_acts_is_named() -> None:
    table = PAGE.partition("## Acts")[2].partition("**A human")[0]
    tools = {name for name, _ in inspect.getmembers(ActTools, inspect.isfunction) if not name.startswith("_")}
    first_columns = re.findall(r"(?m)^\| (`.*?) \|", table)
    assert set(re.findall(r"`([a-z_]+)`", " ".join(first_columns))) == tools


def test_every_tool_is_named() -> None:
    names = {tool.name for tool in LocalAssistant("http://127.0.0.1:1").tools()}
    table = PAGE.partition("## The tools")[2].partition("An answer is")[0]
    assert set(re.findall(r"`([a-z_]+)`", table)) == names
