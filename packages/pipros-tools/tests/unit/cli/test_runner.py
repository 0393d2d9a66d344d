from __future__ import annotations

import importlib
import subprocess
import sys
from optparse import OptionParser

import pytest

from pipros.basics.errors import Unreachable
from pipros.safe.yaml import YamlError
from pipros_tools.cli.runner import CommandError, dispatch, option_parser, run
from pipros_tools.cli.yaml_args import documents_of, value_of
from pipros_tools.graph.output import bullets

HEAVY = {
    "argparse", "asyncio", "catkin_pkg", "concurrent.futures", "dataclasses", "email", "http.client",
    "logging", "numpy", "optparse", "pipros.msg.base", "pipros.node", "pipros.wire.xmlrpc_fast", "rospkg",
    "xmlrpc.client", "yaml",
}  # fmt: skip
"""What a command that only asks the master has no need of, and a person would wait for."""


def test_an_error_is_one_line_and_a_code(capsys: pytest.CaptureFixture[str]) -> None:
    def fail() -> int:
        raise CommandError("the thing does not exist")

    assert (run(fail), run(fail, error_code=2)) == (1, 2)
    assert capsys.readouterr().err == "ERROR: the thing does not exist\n" * 2


def test_a_missing_master_is_reported_with_noetics_text(capsys: pytest.CaptureFixture[str]) -> None:
    def fail() -> int:
        raise Unreachable("master [http://127.0.0.1:1]", "Connection refused", "Is roscore running?")

    assert (run(fail), capsys.readouterr().err) == (1, "ERROR: Unable to communicate with master!\n")


def test_on_a_terminal_the_error_suggests_a_remedy(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> int:
        raise Unreachable("master [http://127.0.0.1:1]", "Connection refused", "Is roscore running?")

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    run(fail)
    assert "Is roscore running?" in capsys.readouterr().err


def test_ctrl_c_ends_silently(capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted() -> int:
        raise KeyboardInterrupt

    assert (run(interrupted), capsys.readouterr()) == (0, ("", ""))


def test_an_unknown_subcommand_prints_the_overview(capsys: pytest.CaptureFixture[str]) -> None:
    assert dispatch({"known": "nowhere:nothing"}, ["unknown"], "overview", 64) == 64
    assert capsys.readouterr().out == "overview\n"


def test_entries_are_aligned_in_columns() -> None:
    assert bullets("killing:", ["/a", "/b"]) == "killing:\n * /a\n * /b"


@pytest.mark.parametrize(("word", "value"), [("3", 3), ("hello", "hello"), ("", ""), ("[1, 2]", [1, 2])])
def test_words_of_the_command_line_are_yaml(word: str, value: object) -> None:
    assert value_of(word) == value


def test_a_document_is_yielded_when_its_separator_arrives() -> None:
    lines = iter(["data: 1\n", "---\n", "data: 2\n"])
    documents = documents_of(lines)
    assert next(documents) == {"data": 1}
    assert next(lines) == "data: 2\n"  # not yet read


def test_the_last_document_needs_no_separator_and_empty_ones_are_left_out() -> None:
    assert list(documents_of(["---\n", "1\n", "---\n", "---\n", "2\n"])) == [1, 2]


def test_documents_cannot_construct_objects() -> None:
    with pytest.raises(YamlError):
        list(documents_of(["!!python/object/apply:os.getpid []\n"]))


@pytest.mark.parametrize("command", [
    "rostopic list", "rostopic info /x", "rosnode list", "rosparam list", "rosparam get /x",
    "complete 2 rostopic echo /",
])  # fmt: skip
def test_quick_commands_import_nothing_heavy(command: str) -> None:
    program, *arguments = command.split()
    script = (
        f"import sys; from pipros_tools.cli.{program} import main; main({arguments!r});"
        f"print(sorted({HEAVY} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    "words", [[], ["a"], ["a", "-v"], ["--size", "3", "a"], ["-n", "4", "--", "-1"], ["a", "b", "--also=c"]]
)
def test_a_command_line_gives_the_same_with_and_without_optparse(words: list[str]) -> None:
    def add_options(parser: OptionParser) -> None:
        parser.add_option("-v", dest="verbose", action="store_true", help="tell more")
        parser.add_option("--no-tell", dest="verbose", action="store_false")
        parser.add_option("-s", "--size", type="int", default=7)
        parser.add_option("-n", type="int")
        parser.add_option("--also-this", "--also", action="append", default=[])
        parser.add_option("--call", action="callback", callback=print)
        parser.add_option("--into", dest="into", action="callback", callback=print, default=[])

    ours, genuine = option_parser("rosx", "[options]"), OptionParser(prog="rosx")
    for parser in (ours, genuine):
        add_options(parser)
    options, rest = ours.parse_args(list(words))
    expected, expected_rest = genuine.parse_args(list(words))
    assert vars(options) == vars(expected)
    assert rest == expected_rest


def test_a_mistake_without_an_option_is_worded_by_optparse(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        option_parser("rosx", "thing").error("no thing")
    assert end.value.code == 2
    assert capsys.readouterr().err == "Usage: rosx thing\n\nrosx: error: no thing\n"


@pytest.mark.parametrize("uri", ["nonsense", "http://", "http://127.0.0.1", "ftp://127.0.0.1:11311"])
@pytest.mark.parametrize(
    "command", ["rostopic list", "rosnode info /x", "rosparam get /x", "rosservice list"]
)
def test_a_malformed_master_uri_is_named(
    command: str, uri: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    program, *arguments = command.split()
    main = importlib.import_module(f"pipros_tools.cli.{program}").main
    assert main(arguments) == (2 if program == "rosservice" else 1)
    assert f"ERROR: ROS_MASTER_URI [{uri}]" in capsys.readouterr().err
