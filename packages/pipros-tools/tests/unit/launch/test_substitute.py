from __future__ import annotations

from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.basics.names import is_legal_base
from pipros.safe.expr_walk import ExpressionError
from pipros_tools.launch.substitute import Substitution, SubstitutionError, UnsetArgument, anonymous_name


def find(package: str, path: str) -> str:
    if package != "talkers":
        raise NotFound(f"package [{package}] not found")
    return str(Path("/ws/talkers") / path) if path else "/ws/talkers"


@pytest.fixture
def substitution() -> Substitution:
    return Substitution(
        find=find,
        environment={"HOME": "/home/ada"},
        make_anonymous=lambda base: f"{base}_unique",
        arguments={"a": "3", "b": "true", "s": "hi there", "unset": None},
        folder="/launch",
    )


@pytest.mark.parametrize(("text", "result"), [
    ("nothing to do: $x $ ( )", "nothing to do: $x $ ( )"), ("$(arg a)$(arg b)", "3true"),
    ("$( arg  a )", "3"), ("x/$(arg s)/y", "x/hi there/y"), ("$$(arg a)", "$3"), ("$(arg a))", "3)"),
    ("$(env HOME)/x", "/home/ada/x"), ("$(optenv HOME none)", "/home/ada"),
    ("$(optenv NOPE a b  c)", "a b c"), ("$(optenv NOPE)", ""),
    ("$(anon n)-$(anon n)", "n_unique-n_unique"), ("$(dirname)/x", "/launch/x"),
    ("$(find talkers)", "/ws/talkers"), ("$(find talkers)/", "/ws/talkers"),
    ("$(find talkers)/launch/x.launch", "/ws/talkers/launch/x.launch"),
    ("$(find talkers)/$(arg a)", "/ws/talkers/3"), ("--x=$(find talkers)/y --z", "--x=/ws/talkers/y --z"),
    ("$(find talkers)/a:$(find talkers)/b", "/ws/talkers/a:/ws/talkers/b"),
    ("$(find talkers)$(find talkers)/b", "/ws/talkers//ws/talkers/b"),
    ("$(find talkers)$x", "/ws/talkers/$x"),
    ("$(find talkers) $(find talkers)", "/ws/talkers /ws/talkers"),
    ("$(eval optenv('NOPE', 7) + 1)", "8"), ("$(eval s.title().split())", "['Hi', 'There']"),
    ("$(eval ','.join([c + 'x' for c in s.split()]))", "hix,therex"),
    ("$(eval list(map(float, '1 2'.split())))", "[1.0, 2.0]"), ("$(eval a + 1)", "4"),
    ("$(eval arg('a') + 1)", "4"), ("$(eval not b)", "False"), ("$(eval s + '!')", "hi there!"),
    ("$(eval 'x)' + env('HOME'))", "x)/home/ada"), ("$(eval optenv('NOPE', 'd'))", "d"),
    ("$(eval find('talkers') + dirname())", "/ws/talkers/launch"),
    ("$(eval anon('n') == anon('n'))", "True"), ("$()", "$()"), ("$(arg a", "$(arg a"),
])  # fmt: skip
def test_substitutions_are_made_as_noetic_makes_them(
    substitution: Substitution, text: str, result: str
) -> None:
    assert substitution.resolve(text) == result


@pytest.mark.parametrize(("text", "complaint"), [
    ("$(arg unset)", "requires the 'unset' arg to be set"),
    ("$(arg nope)", "requires the 'nope' arg to be set"), ("$(arg)", "must specify a variable name"),
    ("$(arg a b)", "may only specify one arg"), ("$(env NOPE)", "environment variable 'NOPE' is not set"),
    ("$(env)", "only accepts one argument"), ("$(optenv)", "must specify an environment variable"),
    ("$(anon)", "must specify a name"), ("$(anon a b)", "may only specify one name"),
    ("$(find)", "only accepts one argument"), ("$(foo x)", r"Unknown substitution command \[foo x\]"),
    ("x$(eval 1)", r"Unknown substitution command \[eval 1\]"),
    ("$(dirname x)", "Unknown substitution command"), ("$(arg $(arg a))", "Dollar signs"),
    ("$(optenv X (y))", "Invalid left parenthesis"), ("$(eval __import__('os'))", "double underscore"),
    ("$(eval arg('nope'))", "requires the 'nope' arg"),
])  # fmt: skip
def test_a_bad_substitution_is_explained(substitution: Substitution, text: str, complaint: str) -> None:
    with pytest.raises(SubstitutionError, match=complaint):
        substitution.resolve(text)


@pytest.mark.parametrize("text", ["$(eval nope)", "$(eval 1/0)", "$(eval s.encode())", "$(eval 9**9**9)"])
def test_a_bad_expression_is_refused(substitution: Substitution, text: str) -> None:
    with pytest.raises(ExpressionError):
        substitution.resolve(text)


def test_an_unknown_package_is_named(substitution: Substitution) -> None:
    for text in ("$(find nope)/x", "$(eval find('nope'))"):
        with pytest.raises(NotFound, match="nope"):
            substitution.resolve(text)


def test_dirname_needs_a_file(substitution: Substitution) -> None:
    substitution.folder = None
    with pytest.raises(SubstitutionError, match=r"Cannot substitute \$\(dirname\)"):
        substitution.resolve("$(dirname)")


def test_unset_arguments_can_be_tolerated(substitution: Substitution) -> None:
    substitution.unset_as = ""
    assert substitution.resolve("x$(arg unset)y") == "xy"
    substitution.unset_as = None
    with pytest.raises(UnsetArgument):
        substitution.resolve("$(arg unset)")


def test_anonymous_names_are_legal_and_differ() -> None:
    first, second = anonymous_name("n"), anonymous_name("n")
    assert first != second
    assert is_legal_base(first)
