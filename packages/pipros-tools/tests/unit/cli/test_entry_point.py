"""Every command has usable standard streams, also in threads that outlive it."""

import errno
import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from optparse import OptionParser

import pytest

from pipros.basics.errors import MissingExtra, Unreachable
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.safe.yaml import YamlError
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, dispatch, option_parser, run
from pipros_tools.cli.yaml_args import documents_of, value_of
from pipros_tools.graph.output import bullets

if sys.platform != "win32":
    import pty

PRINTING = """
import threading
from pipros_tools.cli.entry_point import command

class Slow:
    def __str__(self):
        has_ended.wait()
        return "slow"

def main():
    printing.start()
    return 0

has_ended = threading.Event()
printing = threading.Thread(target=lambda: print(Slow(), flush=True))
command(main)()
has_ended.set()
printing.join()
"""


NAMING = """
import sys
from pipros_tools.cli.entry_point import command

def main():
    for stream in sys.stdout, sys.stderr:
        print("\\x1b[31mto\\x1b[0m", sys.argv[1], file=stream, flush=True)
    return 0

command(main)()
"""


def test_a_thread_may_print_while_its_command_ends() -> None:
    done = subprocess.run([sys.executable, "-c", PRINTING], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "slow\n", "")


def test_an_interrupted_command_ends_with_the_code_of_shells_and_prints_nothing(capsys) -> None:
    @command
    def main() -> int:
        raise KeyboardInterrupt

    assert (main(), capsys.readouterr()) == (130, ("", ""))


def test_a_missing_library_is_named_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    @command
    def main() -> int:
        raise MissingExtra("pictures need OpenCV, which is not installed", name="cv2")

    assert main() == 1
    assert capsys.readouterr() == ("", "ERROR: pictures need OpenCV, which is not installed\n")


def test_ctrl_c_before_the_command_has_begun_prints_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pipros.basics.interrupts.install", interrupted)

    assert command(lambda: 0)() == 130


@pytest.mark.parametrize(("guarded", "code"), [(command, 130), (exits_after_ctrl_c(), 0)])
def test_ctrl_c_while_a_class_is_made_prints_no_traceback(
    guarded: Callable[[Callable[[], int]], Callable[[], int]], code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    class Field:
        def __set_name__(self, owner: type, name: str) -> None:
            raise KeyboardInterrupt

    @guarded
    def main() -> int:
        class _Message:
            below = Field()

        return 0

    assert (main(), capsys.readouterr()) == (code, ("", ""))


LACKING = """
import sys
from pipros_tools.cli.entry_point import command

def main():
    for stream in (sys.stdout, sys.stderr):
        print("Stra\\u00dfe \\u6c34 \\udcff", file=stream)
    return 0

command(main)()
"""


@pytest.mark.parametrize("errors", ["strict", "surrogateescape"])  # the second in pipes on Windows
def test_characters_that_an_encoding_lacks_are_written_as_escapes(errors: str) -> None:
    variables = {**os.environ, "PYTHONIOENCODING": f"cp1252:{errors}"}
    done = subprocess.run([sys.executable, "-c", LACKING], capture_output=True, env=variables, check=False)
    byte = {"strict": b"\\udcff", "surrogateescape": b"\xff"}[errors]
    assert (done.returncode, done.stdout) == (0, b"Stra\xdfe \\u6c34 " + byte + os.linesep.encode())
    assert done.stderr.startswith(b"Stra\xdfe \\u6c34 ")


@pytest.mark.needs("pseudo-terminals")
def test_a_terminal_gets_no_control_characters_of_names_but_the_commands_own() -> None:
    name = "\x1b]52;c;aGk=\x07\x9b2J\rx\x08\x1b[2J.bag"
    screen, terminal = pty.openpty()
    subprocess.run([sys.executable, "-c", NAMING, name], stdout=terminal, stderr=terminal, check=True)
    os.close(terminal)
    assert os.read(screen, 1000) == (f"\x1b[31mto\x1b[0m {repr(name)[1:-1]}\r\n" * 2).encode()
    os.close(screen)


def test_output_to_a_closed_pipe_of_windows_ends_silently() -> None:
    code = (
        "import os, pipros_tools.cli.entry_point as module\n"
        "module.ON_WINDOWS = True\n"
        "if hasattr(os, 'eventfd'):  # refuses one byte with the error that Windows has for a closed pipe\n"
        "    os.dup2(os.eventfd(0), 1)\n"
        "else:\n"
        "    reader, writer = os.pipe(); os.close(reader); os.dup2(writer, 1)\n"
        "raise SystemExit(module.command(lambda: print(end='x') or 0)())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize(("code", "action"), [(errno.ENOSPC, "write"), (errno.EACCES, "use")])
def test_a_file_error_without_an_answer_of_the_command_is_one_line(code: int, action: str, capsys) -> None:
    @command
    def main(*names: str) -> int:
        raise OSError(code, os.strerror(code), *names)

    assert main("x\n.txt") == 1
    assert capsys.readouterr().err == f"ERROR: cannot {action} x\\n.txt: {os.strerror(code)}\n"
    if action == "use":
        with pytest.raises(OSError, match=os.strerror(code)):
            main()


@pytest.mark.parametrize(
    ("error", "limit"),
    [
        (OSError(errno.EMFILE, "x"), "ulimit -n"),
        (RuntimeError("can't start new thread"), "ulimit -u"),
        (MemoryError(), "ulimit -v"),
    ],
)
def test_a_command_for_which_the_system_has_no_room_says_so_in_one_line(error, limit: str, capsys) -> None:
    @command
    def main() -> int:
        raise error

    assert main() == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert limit in line


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


def test_on_a_terminal_the_error_suggests_a_remedy(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
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
def test_a_malformed_master_uri_is_named(command: str, uri: str, monkeypatch, capsys) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    program, *arguments = command.split()
    main = importlib.import_module(f"pipros_tools.cli.{program}").main
    assert main(arguments) == (2 if program == "rosservice" else 1)
    assert f"ERROR: ROS_MASTER_URI [{uri}]" in capsys.readouterr().err
