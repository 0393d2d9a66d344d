"""Files that no command can use, and an interpreter that runs one command with each of them."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

DEEP = {"yaml": b"[" * 200_000, "xml": b"<launch>" + b"<group>" * 200_000}
ALIASES = b"a: &a [x, x]\n" + b"".join(
    b"%c: &%c [%s]\n" % (letter, letter, b", ".join([b"*%c" % (letter - 1)] * 9)) for letter in range(98, 122)
)
ENTITIES = (
    b'<!DOCTYPE launch [<!ENTITY a "x">'
    + b"".join(
        b'<!ENTITY %c "%s">' % (letter, b"&%c;" % (letter - 1) * 9) for letter in range(98, 122)
    )
    + b"]><launch>&y;</launch>"
)  # fmt: skip
XML = ("launch", "urdf", "xml")

RUN = """
import contextlib, importlib, json, os, resource, runpy, select, signal, sys
from importlib.metadata import entry_points

words, cases, seconds = json.loads(sys.stdin.read())
script = None if not words[0].startswith("/") else words[0]
main = None if script else next(iter(entry_points(group="console_scripts", name=words[0]))).load()

def run(words):
    resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_FSIZE, (100 << 20, 100 << 20))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(20 * seconds)
    sys.argv = words
    if script:
        sys.path[0] = os.path.dirname(script)
        runpy.run_path(script, run_name="__main__")
    else:
        sys.exit(main())

known = {*sys.modules}
for name, file in cases:
    log = os.open("output", os.O_RDWR | os.O_CREAT | os.O_TRUNC)
    child = os.fork()
    if not child:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(log, 1)
        os.dup2(log, 2)
        status = 1
        try:
            run([word.replace("FILE", file).replace("KIND", name) for word in words])
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
            if isinstance(ended.code, str):
                print(ended.code, file=sys.stderr)
        except BaseException:
            import traceback
            traceback.print_exc()
        finally:
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            with open("imported", "w") as file:
                file.write(" ".join(each for each in [*sys.modules] if each not in known))
            os._exit(status & 255)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.lseek(log, 0, 0)
    print(json.dumps([name, status, os.read(log, 100_000).decode(errors="replace")]), flush=True)
    os.close(log)
    if file == cases[0][1] and os.path.exists("imported"):  # so that the others need not import it again
        for each in open("imported").read().split():
            with contextlib.suppress(Exception):
                importlib.import_module(each)
"""


CONTENTS = ("empty", "binary", "deep", "bomb", "cut")
PLACES = ("folder", "missing", "huge", "pipe", "circle", "endless")
KINDS = (*CONTENTS, *PLACES)


def make_unusable(kind: str, file: Path, good: bytes = b"") -> None:
    """Create a file that no command can use."""
    is_xml = file.suffix[1:] in XML
    if kind == "folder":
        file.mkdir()
    elif kind == "huge":
        file.touch()
        os.truncate(file, 20 << 30)
    elif kind == "pipe":
        os.mkfifo(file)
    elif kind == "circle":
        file.symlink_to(file)
    elif kind == "endless":
        file.symlink_to("/dev/zero")
    elif kind in CONTENTS:
        contents = {
            "empty": b"", "binary": bytes(range(256)) * 20, "deep": DEEP["xml" if is_xml else "yaml"],
            "bomb": ENTITIES if is_xml else ALIASES, "cut": good[: len(good) // 2],
        }  # fmt: skip
        file.write_bytes(contents[kind])


def outcomes(
    words: Sequence[str], cases: Sequence[tuple[str, str]], folder: Path, environment: Mapping[str, str]
) -> dict[str, tuple[int, str]]:
    """Run a command for each kind of file, with `FILE` replaced. Return exit codes and output by kind."""
    ended = subprocess.run(
        [sys.executable, "-c", RUN], input=json.dumps([words, cases, 15]),
        env={**os.environ, "ROS_HOME": str(folder), "PIPROS_BROWSER": "off", **environment}, cwd=folder,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    found = {kind: (status, output) for kind, status, output in map(json.loads, ended.stdout.splitlines())}
    assert list(found) == [kind for kind, _ in cases]
    return found


def faults(status: int, output: str, named: str) -> str:
    """Return why an answer is not one clear line about a file, or an empty text."""
    lines = [each for each in output.splitlines() if each.strip()]
    reasons = [
        "no error" if status == 0 else "", f"ended by signal {-status}" if status < 0 else "",
        "a traceback" if "Traceback (most" in output else "",
        "does not name the file" if named not in output else "", "many lines" if len(lines) > 6 else "",
    ]  # fmt: skip
    found = ", ".join(filter(None, reasons))
    return found and f"{found}: {' // '.join(lines[-3:])[-300:]}"
