"""Small CMake scripts with their results or errors, shared by unit tests and `tests.interop`."""

from dataclasses import dataclass

from tests.support.environments import file_of_tests

FOLDER = file_of_tests("golden/cmake")
TOPICS = sorted(file.stem for file in FOLDER.glob("*.cmake"))
RESULT = "#="


@dataclass(frozen=True, slots=True)
class Case:
    """A script that sets the variable `o`, its line number in the file, and the value of `o` in CMake."""

    line: int
    script: str
    expected: str


def read_cases(topic: str) -> list[Case]:
    """Return the cases in a file in `FOLDER`: scripts, each followed by result lines that start with `#=`."""
    cases: list[Case] = []
    script: list[str] = []
    result: list[str] = []
    lines = (FOLDER / f"{topic}.cmake").read_text("utf-8").splitlines()
    for number, line in enumerate([*lines[1:], ""], 2):
        if line.startswith(RESULT):
            result.append(line.removeprefix(RESULT).removeprefix(" "))
            continue
        if result:
            text = "\n".join(script).strip("\n")
            cases.append(Case(number - len(result) - text.count("\n") - 1, text, "\n".join(result)))
            script, result = [], []
        script.append(line)
    return cases


MISTAKES = [
    'message(FATAL_ERROR "a reason")', "nonsense()", "include(nope.cmake)", "include()", "list(NOPE x)",
    "list(GET)", "list(JOIN L)", "set(L a b)\nlist(GET L 5 o)", 'set(L "")\nlist(GET L 0 o)',
    "set(L a)\nlist(SUBLIST L 5 1 o)", "set(L a)\nlist(REMOVE_AT L 3)", "list(INSERT L 5 x)",
    "list(SORT L COMPARE NOPE)", "list(FILTER L MAYBE REGEX a)", "list(TRANSFORM L NOPE)",
    'string(SUBSTRING "abc" 7 1 o)', 'string(SUBSTRING "abc" 0 -2 o)', "string(REPEAT a -1 o)",
    "string(ASCII 300 o)", "string(COMPARE EQUAL a o)", "string(LENGTH)",
    "string(UUID o NAMESPACE x NAME y TYPE SHA1)", "math(EXPR a)", 'math(EXPR a "1 +")', 'math(EXPR a "1.5")',
    'math(EXPR a "1 / 0")', 'math(EXPR a "9223372036854775808")', "file(READ nope o)", "file(STRINGS nope o)",
    "file(SIZE nope o)", "file(RENAME nope x)", "file(COPY nope DESTINATION x)", "file(TOUCH no/folder/x)",
    "file(REMOVE)", "if(a b)\nendif()", "if(a STREQUAL)\nendif()", "while(TRUE", "while()\nendwhile()",
    "endif()", "else()", "function(f a)\nendfunction()\nf()", "function()\nendfunction()",
    'string(REGEX MATCH "(" o x)', 'string(REGEX MATCH "b*" o abc)', 'string(REGEX MATCHALL "b*" o abc)',
    'string(REGEX REPLACE "" x o a)', 'string(REGEX REPLACE "a" "\\\\5" o a)',
    "foreach(i RANGE 1 5 -1)\nendforeach()", "foreach(i RANGE x)\nendforeach()",
    "foreach(i IN x)\nendforeach()", "configure_file(nope out)", "configure_file(a)",
    "execute_process(COMMAND false COMMAND_ERROR_IS_FATAL ANY)", "execute_process()",
    "find_program(X nope_of_that_name REQUIRED)", "get_filename_component(o a NOPE)",
    "get_filename_component(o)", "get_property(o)", "set_property(NOPE)", "separate_arguments()",
    "cmake_parse_arguments(A)", "option()", "set()", "unset()",
]  # fmt: skip
"""Scripts that CMake rejects."""


def line_of_mistake(text: str) -> int:
    """Return the line number of the error in a script: the last line, or the first line of a block."""
    return text.count("\n") + 1 if text.startswith(("set(", "function(f")) else 1
