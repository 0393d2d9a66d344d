import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_workspace.cmake.condition import is_true
from pipros_workspace.cmake.language import CMakeError, CommandArgument, expand, parse
from pipros_workspace.cmake.scope import Scope
from tests.support.constants import Constants


def words(text: str, **variables: str) -> list[str]:
    (command,) = parse(text, "CMakeLists.txt")
    return expand(command.arguments, variables, {"HOME": "/home/ada"}, 1_000)


def test_commands_have_names_arguments_and_lines() -> None:
    commands = parse(
        "# a comment\nProject(x)\n\nadd_message_files(\n  FILES\n  A.msg # one\n  B.msg\n)\n", "f"
    )
    assert [(command.name, command.written_name, command.line) for command in commands] == [
        ("project", "Project", 2),
        ("add_message_files", "add_message_files", 4),
    ]
    assert commands[1].arguments == (
        CommandArgument("FILES"), CommandArgument("A.msg"), CommandArgument("B.msg")
    )  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), [
    ("f(a b\tc)", ["a", "b", "c"]), ('f("a b" c)', ["a b", "c"]), ('f("say \\"x\\"")', ['say "x"']),
    ("f(a;b;;c)", ["a", "b", "c"]), ('f("a;b")', ["a;b"]), ("f(${V}/x)", ["v/x"]), ("f(${L})", ["1", "2"]),
    ('f("${L}")', ["1;2"]), ("f(${NOPE}x ${NOPE})", ["x"]), ("f($ENV{HOME}/x)", ["/home/ada/x"]),
    ("f(${A_${V}})", ["nested"]), ("f([[raw ${V} ;]])", ["raw ${V} ;"]), ("f([=[a]]b]=])", ["a]]b"]),
    ("f(a #[[ block\n comment ]] b)", ["a", "b"]),
    ("f(a # to the end\n b)", ["a", "b"]),
    ("f((a) b)", ["(", "a", ")", "b"]), ('f(-DX="a b")', ['-DX="a b"']), ("f(a\\ b)", ["a b"]), ("f()", []),
])  # fmt: skip
def test_arguments_are_read_as_cmake_reads_them(text: str, expected: list[str]) -> None:
    assert words(text, V="v", L="1;2", A_v="nested") == expected


@pytest.mark.parametrize(("text", "place"), [
    ("f(a", "CMakeLists.txt:1 (f)"), ("\n\nf(a\n", "CMakeLists.txt:3 (f)"),
    ("f\n", "CMakeLists.txt:1 (f)"), ("f() )", "CMakeLists.txt:1"), ("f()\n 5x()", "CMakeLists.txt:2"),
    ('f("open)', "CMakeLists.txt:1"),
])  # fmt: skip
def test_malformed_text_is_reported_with_its_line(text: str, place: str) -> None:
    with pytest.raises(CMakeError) as error:
        parse(text, "CMakeLists.txt")
    assert str(error.value).startswith(f"CMake Error at {place}")


@given(st.text(alphabet='ab()"\\#[]=${}; \n', max_size=60))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        commands = parse(text, "f")
    except CMakeError:
        return
    for command in commands:
        assert 1 <= command.line <= text.count("\n") + 1
        assert all(isinstance(argument, str) for argument in expand(command.arguments, {}, {}, 1_000))


@pytest.mark.parametrize(("condition", "expected"), [
    ("ON", True), ("0", False), ("2", True), ("SET", True), ("UNSET", False), ("OFFVAR", False),
    ("x-NOTFOUND", False), ('"SET"', False), ("NOT UNSET", True), ("SET AND UNSET", False),
    ("SET OR UNSET AND UNSET", False), ("( SET OR UNSET ) AND UNSET", False), ("DEFINED SET", True),
    ("DEFINED NOPE", False), ("COMMAND add_rostest", True), ("EXISTS /", True),
    ("IS_DIRECTORY /nope", False), ("SET STREQUAL value", True), ('"SET" STREQUAL "value"', False),
    ("NUMBER GREATER 3", True), ("NUMBER LESS_EQUAL 3", False), ("SET EQUAL 3", False),
    ("VERSION VERSION_GREATER_EQUAL 3.2", True), ("VERSION VERSION_LESS 3.10", True),
    ("a IN_LIST LIST", True), ("z IN_LIST LIST", False), ("SET MATCHES ^va", True), ("", False),
    ("NOT", False), ("SET AND NOT", False), ("NOT NOT", True), ("( )", False), ("SET OR ( NOT )", True),
    ("NOT ( NOT )", True),
])  # fmt: skip
def test_conditions_hold_as_in_cmake(condition: str, expected: bool) -> None:
    variables = {"SET": "value", "OFFVAR": "OFF", "NUMBER": "7", "VERSION": "3.2.0", "LIST": "a;b"}
    written = [(word.strip('"'), word.startswith('"')) for word in condition.split()]
    assert is_true(written, variables, {"add_rostest"}) is expected


@pytest.mark.parametrize("condition", ["( SET", "SET SET", "SET STREQUAL", "NOT AND SET", "SET OR"])
def test_an_invalid_condition_is_refused(condition: str) -> None:
    with pytest.raises(ValueError, match="condition"):
        is_true([(word, False) for word in condition.split()], {})


def scope(**variables: str) -> Scope:
    return Scope(variables, {"CACHED": "c", "A": "from the cache"}, {"HOME": "/h"})


def test_variables_hide_cache_entries() -> None:
    current = scope(A="own")
    assert (current.values["A"], current.values["CACHED"]) == ("own", "c")
    current.unset("A")
    current.unset("NEVER")
    assert current.values["A"] == "from the cache"
    current.values["CACHED"] = "own"
    assert current.cache["CACHED"] == "c"


def test_variables_of_an_inner_scope_end_with_it_unless_set_in_the_parent() -> None:
    current = scope(A="1", B="2", C="3")
    with current.inner():
        current.values["A"] = "inner"
        current.values["NEW"] = "inner"
        current.set_in_parent("B", "set")
        current.set_in_parent("C", None)
        assert (current.values["B"], current.values["C"]) == ("2", "3")
        with current.inner():
            current.set_in_parent("A", "from two levels down")
        assert current.values["A"] == "from two levels down"
    assert dict(current.values) == {"A": "1", "B": "set", "CACHED": "c"}


def test_an_error_ends_an_inner_scope_as_well() -> None:
    current = scope(A="1")
    with pytest.raises(KeyError), current.inner():
        current.values["A"] = current.values["NOPE"]
    assert current.values["A"] == "1"


def test_restored_variables_have_their_former_values() -> None:
    current = scope(A="1")
    with current.restored(["A", "B"]):
        current.values.update({"A": "2", "B": "2", "C": "2"})
    assert (current.values["A"], current.values.get("B"), current.values["C"]) == ("1", None, "2")


@pytest.mark.parametrize(("path", "source", "binary"), [
    ("a", "/s/a", "/b/a"), ("../a", "/a", "/a"), ("/abs/./x", "/abs/x", "/abs/x"), ("", "/s", "/b")
])  # fmt: skip
def test_paths_are_below_source_and_binary_folder(path: str, source: str, binary: str) -> None:
    current = scope(CMAKE_CURRENT_SOURCE_DIR="/s", CMAKE_CURRENT_BINARY_DIR="/b")
    assert (current.in_source(path), current.in_binary(path)) == (source, binary)


def test_the_size_of_variables_is_bounded_and_released(constants: Constants) -> None:
    constants(CMAKE_VALUE_CHARACTERS=10, CMAKE_CHARACTERS=20)
    current = Scope({}, {}, {})
    with pytest.raises(ValueError, match="more than 10 characters"):
        current.values["A"] = "x" * 11
    for _ in range(5):
        current.values["A"] = "x" * 10
        current.values["B"] = "y" * 10
        with pytest.raises(ValueError, match="more than 20 characters"):
            current.values["C"] = "z"
        current.unset("B")
        with current.inner():
            current.values["B"] = "y" * 10
        current.values["C"] = "z"
        current.unset("C")
