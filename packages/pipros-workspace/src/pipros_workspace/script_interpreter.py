"""Choose the Python interpreter of a script from its first line.

`#!/usr/bin/env python3` runs the first `python3` in `PATH`, and the tools set `PATH` so that this is pipros's
interpreter. A first line such as `#!/usr/bin/python3` names a specific interpreter. If that interpreter has
`rospy`, it belongs to a genuine ROS, whose other packages the script may need. If not, a node cannot run with
it, so pipros's own interpreter runs the script, unless the script was installed with that interpreter.
A script that imports rclpy, and not rospy, runs with the interpreter that it names.
`rospy` is looked up in the file system, because starting an interpreter takes longer than the rest of rosrun.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from pipros.basics.graph_variables import InvalidEnvironment
from pipros.basics.input_file import open_file, read_text
from pipros_workspace.client_library import is_ros2_script

VARIABLE = "PIPROS_INTERPRETER"
"""`own` starts Python scripts with pipros's interpreter, `script` with the interpreter that they name."""

_PYTHON = re.compile(r"python(?P<major>\d)?(\.\d+){0,9}")
_VERSION = re.compile(r"python(\d+\.\d+)")
_NEEDED = "rospy"
_FIRST_LINE_BYTES = 256  # the kernel's limit
_PTH_FILE_BYTES = 64 * 1024


@dataclass(frozen=True, slots=True)
class ScriptInterpreter:
    """The interpreter that starts a Python script.

    Attributes:
        words: the words to put before the script; empty if the operating system starts the script itself.
        interpreter: the path of the interpreter; None if the script cannot be started.
        reason: the reason for this choice, as the rest of a sentence about the script.
        has_env: whether the first line names `env`, which the operating system can start in any case.
    """

    words: tuple[str, ...]
    interpreter: str | None
    reason: str
    has_env: bool = False


@dataclass(frozen=True, slots=True)
class _FirstLine:
    named: str  # a path, or the name that `env` looks up
    option: str
    has_env: bool


def interpreter_of(program: Path, variables: Mapping[str, str]) -> ScriptInterpreter | None:
    """Return the interpreter that starts `program`; None if its first line does not name Python.

    `variables` is the environment of the program.

    Raises:
        InvalidEnvironment: `PIPROS_INTERPRETER` has an unknown value.
        OSError: the program cannot be read.
    """
    choice = variables.get(VARIABLE, "")
    if choice not in ("", "own", "script"):
        raise InvalidEnvironment(f"{VARIABLE} must be own or script, got [{choice}]")
    line = _first_line(program)
    if line is None:
        return None
    path = shutil.which(line.named, path=variables.get("PATH", os.defpath)) if line.has_env else line.named
    exists = path is not None and os.path.exists(path)
    own = ScriptInterpreter(tuple(filter(None, (sys.executable, line.option))), sys.executable, "")
    if choice == "own":
        return _because(own, f"because {VARIABLE}=own")
    if _is_python_2(line.named) and (path is None or not exists or not _rospy_of(path, variables)):
        return ScriptInterpreter((), None, f"is a Python 2 script ({_named(line)}), {_CONVERT}", line.has_env)
    by_line = ScriptInterpreter((), path if exists else None, "", line.has_env)
    if line.has_env or path is None:
        found = (
            f"the first [{line.named}] in PATH" if exists else f"needs [{line.named}], which is not in PATH"
        )
        return _because(by_line, found)
    if choice == "script":
        return _because(by_line, f"because {VARIABLE}=script" if exists else _absent(path))
    if not exists:
        return _because(own, f"because {path}, which its first line names, does not exist")
    if is_ros2_script(program):
        return _because(by_line, "which its first line names, because it imports rclpy")
    if rospy := _rospy_of(path, variables):
        return _because(by_line, f"which its first line names and which has {_NEEDED} ({rospy})")
    if _is_installed_with(program, path):
        return _because(by_line, "which its first line names and which was installed with it")
    return _because(own, f"because {path}, which its first line names, has no {_NEEDED}")


_CONVERT = (
    "and ROS Noetic runs Python 3; convert it to Python 3, and make '#!/usr/bin/env python3' its first line"
)


def _because(chosen: ScriptInterpreter, reason: str) -> ScriptInterpreter:
    return ScriptInterpreter(chosen.words, chosen.interpreter, reason, chosen.has_env)


def _absent(path: str) -> str:
    return f"needs the interpreter {path}, which does not exist"


def _named(line: _FirstLine) -> str:
    return f"#!/usr/bin/env {line.named}" if line.has_env else f"#!{line.named}"


def _first_line(program: Path) -> _FirstLine | None:
    with open_file(program) as file:
        start = file.read(_FIRST_LINE_BYTES).split(b"\n", 1)[0]
    if not start.startswith(b"#!") or start.endswith(b"\r"):
        return None
    # As in the kernel, everything after the interpreter is a single argument.
    named, _, option = os.fsdecode(start[2:]).strip(" \t").replace("\t", " ").partition(" ")
    option = option.strip()
    has_env = os.path.basename(named) == "env"
    if has_env:
        named, option = option, ""
    if not _PYTHON.fullmatch(os.path.basename(named)):
        return None
    return _FirstLine(named, option, has_env)


def _is_python_2(named: str) -> bool:
    match = _PYTHON.fullmatch(os.path.basename(named))
    return match is not None and match["major"] == "2"


def _rospy_of(interpreter: str, variables: Mapping[str, str]) -> str | None:
    return _lookup(interpreter, variables.get("PYTHONPATH", ""), variables.get("HOME", ""))


@lru_cache(maxsize=64)
def _lookup(interpreter: str, python_path: str, home: str) -> str | None:
    """Return the folder from which an interpreter would import rospy, or None if it cannot.

    pipros's own rospy on `PYTHONPATH` does not count: without its import hook, it finds no messages.
    """
    own = find_spec(_NEEDED)
    own_file = os.path.realpath(own.origin) if own is not None and own.origin else ""
    for folder in _module_folders(interpreter, python_path, home):
        for file in (folder / _NEEDED / "__init__.py", folder / f"{_NEEDED}.py"):
            if file.is_file() and os.path.realpath(file) != own_file:
                return str(file.parent)
    return None


def _module_folders(interpreter: str, python_path: str, home: str) -> Iterator[Path]:
    """Yield the folders from which an interpreter imports modules. Some may not exist."""
    yield from (Path(folder) for folder in python_path.split(os.pathsep) if folder)
    path, real = Path(os.path.abspath(interpreter)), Path(os.path.realpath(interpreter))
    named = _VERSION.match(real.name)
    pattern = f"python{named[1]}" if named else "python[0-9]*"
    prefixes = dict.fromkeys((path.parent.parent, real.parent.parent))
    is_isolated = False
    settings = path.parent.parent / "pyvenv.cfg"
    if settings.is_file():
        text = read_text(settings, errors="replace")
        is_isolated = not re.search(r"(?mi)^include-system-site-packages\s*=\s*true", text)
        prefixes = dict.fromkeys((path.parent.parent,) if is_isolated else prefixes)
    libraries = [
        library
        for prefix in prefixes
        for parent in (prefix / "lib", prefix / "lib64", prefix / "local" / "lib")
        for library in sorted(parent.glob(pattern))
    ]
    if not (named and named[1].startswith("2.")):
        libraries += [prefix / "lib" / "python3" for prefix in prefixes]  # Debian's packages
    if not is_isolated and home:
        libraries += sorted(Path(home, ".local", "lib").glob(pattern))
    for library in libraries:
        for folder in (library / "dist-packages", library / "site-packages"):
            yield folder
            yield from _folders_in_path_files(folder)


def _folders_in_path_files(folder: Path) -> Iterator[Path]:
    """Yield the folders that the `.pth` files in a site folder add to the module path."""
    for file in sorted(folder.glob("*.pth")):
        try:
            with open_file(file) as opened:
                lines = opened.read(_PTH_FILE_BYTES).decode("utf-8", "replace").splitlines()
        except OSError:
            continue
        for line in lines:
            if line.strip() and not line.startswith(("#", "import ", "import\t")):
                yield folder / line.strip()


def _is_installed_with(program: Path, interpreter: str) -> bool:
    """Return whether a program is installed under the interpreter's prefix, as in `/usr/lib/PACKAGE`.

    If so, the program's modules are installed for that interpreter, too.
    """
    prefix = Path(os.path.realpath(interpreter)).parent.parent
    real = Path(os.path.realpath(program))
    return any(real.is_relative_to(prefix / name) for name in ("bin", "lib", "share"))
