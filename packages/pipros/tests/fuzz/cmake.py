"""An untrusted `CMakeLists.txt` is a project or raises CMakeError, in bounded time.

Commands that run programs or touch files are excluded, because they are not restricted. Regular expressions
with several repetitions are also excluded, because they take exponential time.

python -m tests.fuzz.cmake --seconds 60
"""

import contextlib
import io
import os
import re
import sys
import tempfile
from pathlib import Path
from unittest import mock

from pipros_workspace.catkin.project_reader import read_project
from pipros_workspace.cmake import interpreter, regex
from pipros_workspace.cmake.language import CMakeError
from tests.fuzz import mutation
from tests.support.constants import changed

LEFT_OUT = ("configure_file", "execute_process", "file", "find_file", "find_path", "find_program")
WORDS = [
    *(b"\n", b" ", b'"', b"(", b")", b"${", b"}", b";", b"#", b"[[", b"]]", b"[=[", b"\\", b"$ENV{", b"@x@"),
    *(
        b"set(x ", b'set(x "${x}${x}")\n', b"if(", b"elseif(", b"else()\n", b"endif()\n",
        b"foreach(i RANGE 40)\n",
    ),
    *(
        b"foreach(i IN LISTS x)\n", b"endforeach()\n", b"while(", b"endwhile()\n", b"break()\n",
        b"function(f)\n",
    ),
    *(b"f()\n", b"endfunction()\n", b"macro(m a)\n", b"m(1)\n", b"endmacro()\n", b"return()\n", b"block()\n"),
    *(
        b"endblock()\n", b"string(REPEAT ", b"string(ASCII ", b"string(REGEX REPLACE ",
        b"string(REGEX MATCHALL ",
    ),
    *(
        b"string(SUBSTRING ", b"string(TIMESTAMP ", b"string(RANDOM LENGTH ", b"string(JSON ",
        b"string(APPEND x ",
    ),
    *(
        b"list(APPEND x ", b"list(GET x ", b"list(SORT x)\n", b"list(TRANSFORM x ", b"list(SUBLIST x ",
        b"math(EXPR x ",
    ),
    *(
        b"99999999999", b"-1", b"(a*)*b", b"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaa", b"MATCHES", b"STREQUAL", b"AND",
        b"NOT",
    ),
    *(
        b"project(x)\n", b"find_package(catkin REQUIRED COMPONENTS rospy)\n", b"catkin_package()\n",
        b"install(",
    ),
    *(
        b"PROGRAMS x DESTINATION ", b"message(STATUS ", b"message(FATAL_ERROR x)\n",
        b"cmake_parse_arguments(P ",
    ),
    *(
        b"include_guard()\n", b"unset(x)\n", b"PARENT_SCOPE)\n", b"CACHE STRING x)\n",
        b"separate_arguments(x ",
    ),
]  # fmt: skip
LONGER = (500,)

compiled = regex.compiled


def compiled_if_simple(expression: str) -> re.Pattern[str]:
    if sum(map(expression.count, "*+?")) > 1:
        raise ValueError("left out")
    return compiled(expression)


@changed(CMAKE_STEPS=3_000, CMAKE_VALUE_CHARACTERS=20_000, CMAKE_CHARACTERS=1_000_000)
def target(data: bytes) -> None:
    commands = {name: command for name, command in interpreter.VALUE_COMMANDS.items() if name not in LEFT_OUT}
    before = Path.cwd()
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.object(interpreter, "VALUE_COMMANDS", commands),
        mock.patch.object(regex, "compiled", compiled_if_simple),
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
    ):
        Path(folder, "CMakeLists.txt").write_bytes(data)
        os.chdir(folder)
        try:
            read_project(folder, "x", {}, {}, lambda _name: None)
        except CMakeError:
            pass
        finally:
            os.chdir(before)


if __name__ == "__main__":
    sys.exit(mutation.main(target, "cmake", WORDS, LONGER))
