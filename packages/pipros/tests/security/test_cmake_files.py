"""A `CMakeLists.txt` beyond the limits: the error names file and line, and the other packages are built."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros_workspace.cmake.interpreter import Interpreter
from pipros_workspace.cmake.language import CMakeError
from pipros_workspace.cmake.scope import Scope
from tests.support.constants import Constants
from tests.support.workspaces import Workspace

_LONG = "string(REPEAT x 4000000 long)"
HOSTILE = {
    "character beyond all": "string(ASCII 99999999999 x)",
    "half a character": "string(ASCII 55296 x)\nmessage(${x})",
    "value that doubles": 'set(x xx)\nforeach(i RANGE 40)\n  set(x "${x}${x}")\nendforeach()',
    "value that grows": f'{_LONG}\nforeach(i RANGE 9)\n  string(APPEND x "${{long}}")\nendforeach()',
    "many large values": f'{_LONG}\nforeach(i RANGE 999)\n  set(x${{i}} "${{i}}${{long}}")\nendforeach()',
    "long arguments": f'{_LONG}\nmessage("${{long}}${{long}}")',
    "condition of long arguments": f'{_LONG}\nif("${{long}}${{long}}" STREQUAL "")\nendif()',
    "replacement": f'{_LONG}\nstring(REPLACE x "${{long}}" y xxxxxxxx)',
    "replacement by expression": f'{_LONG}\nstring(REGEX REPLACE . "${{long}}" y xxxxxxxx)',
    "joined texts": f'{_LONG}\nstring(JOIN "${{long}}" y a b c d)',
    "joined list": f'{_LONG}\nset(l a b c d)\nlist(JOIN l "${{long}}" y)',
    "changed list": f'{_LONG}\nset(l a b c d)\nlist(TRANSFORM l APPEND "${{long}}")',
    "selected places": "set(l a b)\nlist(TRANSFORM l TOUPPER FOR 0 9999999999999 REGEX)",
    "configured text": f'{_LONG}\nstring(CONFIGURE "@long@@long@" y)',
    "repeated text": "string(REPEAT x 9999999999 y)",
    "random text": "string(RANDOM LENGTH 9999999999 x)",
    "copied device": "configure_file(/dev/zero x)",
    "read device": "file(READ /dev/zero x)",
    "lines of a device": "file(STRINGS /dev/zero x)",
    "input of a program": "execute_process(COMMAND true INPUT_FILE /dev/zero)",
    "file without an end": "include(${CMAKE_CURRENT_SOURCE_DIR}/pipe)",
    "loop without an end": "while(1)\nendwhile()",
    "expression": "math(EXPR x 1/0)",
    "arguments of a macro": f"macro(m)\nendmacro()\n{_LONG}\nm(${{long}} ${{long}})",
    "element of a loop": f"foreach(i {'x' * 4_200_000})\nendforeach()",
    "expression in a condition": f'if("{"a" * 60}!" MATCHES "^(a+)+$")\nendif()',
    "expression in a string": f'string(REGEX MATCHALL "(a|aa)+$" x "{"a" * 90}!")',
    "expression in a replacement": f'string(REGEX REPLACE "(a+)+$" "" x "{"a" * 60}!")',
    "expression for a list": f'set(x "{"a" * 60}!")\nlist(FILTER x EXCLUDE REGEX "(a*)*$")',
    "expression for files": f'file(WRITE x "{"a" * 60}!")\nfile(STRINGS x y REGEX "(a+)+$")',
    "number of digits": "foreach(i RANGE 99999999999999999999999)\nendforeach()",
}


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="needs /dev/zero")
@pytest.mark.parametrize("cmake", HOSTILE.values(), ids=HOSTILE)
def test_a_package_beyond_the_limits_fails_alone(workspace: Workspace, cmake: str) -> None:
    folder = workspace.add("bad", cmake)
    os.mkfifo(folder / "pipe")
    workspace.add("good")

    result = workspace.build()

    assert result.built == ["good"]
    [error] = result.errors
    assert "bad/CMakeLists.txt:" in error
    assert len(error) < 1_000


@pytest.mark.parametrize("body", ["set(x ${j})\n", ""])
def test_nested_loops_are_ended(tmp_path: Path, body: str, constants: Constants) -> None:
    constants(CMAKE_STEPS=1000)
    scope = Scope({}, {}, {})
    interpreter = Interpreter(
        scope, {}, check=lambda _command: None, on_unsupported=lambda _command, _what: None
    )
    text = f"foreach(i RANGE 99)\nforeach(j RANGE 99)\n{body}endforeach()\nendforeach()"

    with pytest.raises(CMakeError, match="more than 1000 commands were executed"):
        interpreter.run_text(text, str(tmp_path / "CMakeLists.txt"))


def test_local_variables_of_a_function_do_not_count_after_it_returns(constants: Constants) -> None:
    constants(CMAKE_CHARACTERS=1000)
    scope = Scope({}, {}, {})
    interpreter = Interpreter(
        scope, {}, check=lambda _command: None, on_unsupported=lambda _command, _what: None
    )

    interpreter.run_text(
        "function(f)\n  string(REPEAT x 200 local)\n  string(REPEAT y 10 mine)\n"
        "  set(result ${mine} PARENT_SCOPE)\nendfunction()\n"
        "foreach(i RANGE 20)\n  f()\nendforeach()\n"
        "foreach(i RANGE 20)\n  string(REPEAT x 200 again)\n  unset(again)\nendforeach()",
        "CMakeLists.txt",
    )

    assert scope.values["result"] == "y" * 10
