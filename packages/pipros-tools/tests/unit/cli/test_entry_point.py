"""Every command has usable standard streams, also in threads that outlive it."""

import errno
import os
import subprocess
import sys
from collections.abc import Callable

import pytest

from pipros.basics.errors import MissingExtra
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_tools.cli.entry_point import command

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


def test_a_thread_may_print_while_its_command_ends() -> None:
    done = subprocess.run([sys.executable, "-c", PRINTING], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "slow\n", "")


def test_an_interrupted_command_ends_with_the_code_of_shells_and_prints_nothing(
    capsys: pytest.CaptureFixture[str],
) -> None:
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


def test_a_full_disk_without_an_answer_of_the_command_is_named_in_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    @command
    def main(code: int) -> int:
        raise OSError(code, os.strerror(code), "x.txt")

    assert main(errno.ENOSPC) == 1
    assert capsys.readouterr().err == f"ERROR: cannot write x.txt: {os.strerror(errno.ENOSPC)}\n"
    with pytest.raises(OSError, match=r"x\.txt"):
        main(errno.EIO)
