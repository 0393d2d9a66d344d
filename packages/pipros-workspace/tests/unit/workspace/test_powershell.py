"""The PowerShell setup file, checked by a grammar of PowerShell, because the shell is not packaged."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import tree_sitter_powershell
from tree_sitter import Language, Node, Parser

from pipros_workspace.environment import shell_code
from pipros_workspace.setup_files import write_setup_files


def read(code: str) -> Node:
    """Return the root of the syntax tree; it has no error."""
    root = Parser(Language(tree_sitter_powershell.language())).parse(code.encode()).root_node
    assert not root.has_error, f"{root}\n{code}"
    return root


def below(node: Node) -> Iterator[Node]:
    for child in node.children:
        yield child
        yield from below(child)


def texts(root: Node, kind: str) -> list[str]:
    return [(node.text or b"").decode() for node in below(root) if node.type == kind]


def values_of(root: Node) -> list[str]:
    """Return the values of all literals, after joining literals and characters that `+` joins."""
    assert (root.text or b"").isascii(), "Windows PowerShell 5 reads code pages"
    values, is_joined = [], False
    for node in below(root):
        text = (node.text or b"").decode()
        if node.type == "+":
            is_joined = True
        if node.type == "verbatim_string_characters":
            part = text[1:-1].replace("''", "'")
        elif node.type == "cast_expression" and (number := re.fullmatch(r"\[char\](\d+)", text)):
            part = chr(int(number[1]))
        else:
            continue
        values.append(values.pop() + part if is_joined else part)
        is_joined = False
    return values


@pytest.mark.parametrize("python", ["/usr/bin/python3", "C:\\Users\\o'neil\\it’s [mine]\\python.exe"])  # noqa: RUF001
def test_the_setup_file_is_powershell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, python: str) -> None:
    monkeypatch.setattr(sys, "executable", python)
    write_setup_files(tmp_path, [tmp_path / "src"], [])
    root = read((tmp_path / "setup.ps1").read_text("utf-8"))
    assert texts(root, "command_name") == [
        "Test-Path", "Where-Object", "Out-String", "Invoke-Expression", "Remove-Variable",
    ]  # fmt: skip
    assert python in values_of(root)
    for literal in texts(root, "verbatim_string_characters"):
        assert '"' not in literal, "PowerShell before 7.3 loses such quotes on the way to a program"


@pytest.mark.parametrize(
    "value",
    ["/a:/b", "it's", "‘quoted’ ‚so‛", "$HOME `n $(evil)", "two\nlines", "", "# no comment", "';evil;'"],  # noqa: RUF001
)
def test_arbitrary_values_survive_as_one_string(value: str) -> None:
    root = read(shell_code({"ROS_PACKAGE_PATH": value, "ROS_DISTRO": "noetic"}, "powershell"))
    assert texts(root, "variable") == ["$env:ROS_PACKAGE_PATH", "$env:ROS_DISTRO"]
    assert values_of(root) == [value, "noetic"]
    assert not texts(root, "command")


def test_the_grammar_notices_mistakes() -> None:
    with pytest.raises(AssertionError):
        read("if (-not (Test-Path $a) { 1 }\n")
