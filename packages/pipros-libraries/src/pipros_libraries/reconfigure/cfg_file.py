"""Run a `.cfg` file, which is a Python program, in a separate process, and read its declarations."""

from __future__ import annotations

import contextlib
import glob
import io
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

from pipros.basics.env import DISTRIBUTION
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_file, read_text
from pipros.basics.posix import NEW_GROUP, kill_with_group
from pipros_libraries.reconfigure import cache
from pipros_libraries.reconfigure.generator import OUTPUT_VARIABLE

TIME_LIMIT_S = 30.0
"""Default time limit for running a `.cfg` file."""

_READ_S = 5.0
"""Maximum time to wait for the end of stderr, which a process that could not be killed may hold open."""

_SHOWN_CHARACTERS = 2_000
_COMMENT = re.compile(r"#.*")
_WORD = re.compile(r"""(?:\$\{\w+\}/)?([^\s"();${}]+)""")

_DEPTH_LIMIT = 100
"""Maximum nesting of groups."""

_Kinds = type | tuple[type, ...]
_GROUP: dict[str, _Kinds] = {
    "name": str,
    "type": str,
    "state": bool,
    "id": int,
    "parent": int,
    "parameters": list,
    "groups": (list, dict),
}
_PARAMETER: dict[str, _Kinds] = {
    "name": str,
    "type": str,
    "level": int,
    "description": str,
    "default": object,
    "min": object,
    "max": object,
    "edit_method": str,
}


class BadConfigFile(PiprosError):
    """A `.cfg` file cannot be read, failed, did not declare parameters, or exceeded its time limit."""


def find(package_folder: Path, name: str) -> Path | None:
    """Return the `.cfg` file for the configuration `name`, or None if the package does not have one.

    This is the file with that name or, if there is none, the first file that contains the name in quotes.
    """
    files = find_all(package_folder)
    for file in files:
        if file.stem == name:
            return file
    mentioned = re.compile(rf"""["']{re.escape(name)}["']""")
    for file in files:
        with contextlib.suppress(OSError):  # the path may be a pipe
            if mentioned.search(read_text(file, errors="replace")):
                return file
    return None


def find_all(package_folder: Path) -> list[Path]:
    """Return a package's `.cfg` files: the files in `cfg/`, then the files named in `CMakeLists.txt`.

    Words in `CMakeLists.txt` that end in `.cfg` are paths or patterns relative to the package's folder. A
    variable before the first slash is assumed to be the package's folder. `CMakeLists.txt` is ignored unless
    it calls `generate_dynamic_reconfigure_options()`.
    """
    found = sorted((package_folder / "cfg").rglob("*.cfg"))
    try:
        text = _COMMENT.sub("", read_text(package_folder / "CMakeLists.txt", errors="replace"))
    except OSError:
        return found
    if "generate_dynamic_reconfigure_options" not in text.lower():
        return found
    for found_cfg in filter(None, (re.match(r".+\.cfg\b", word) for word in _WORD.findall(text))):
        named = (package_folder / path for path in sorted(glob.glob(found_cfg[0], root_dir=package_folder)))
        found += [path for path in named if path not in found]
    return found


def read(path: Path, time_limit_s: float = TIME_LIMIT_S) -> dict[str, Any]:
    """Return the file's declarations: `name`, `description` and `constants`.

    Blocks while the file runs. An unchanged file is not run again, because its declarations are cached.

    Raises:
        BadConfigFile: the file failed, did not declare parameters, wrote malformed declarations, or exceeded
            the time limit; or the file cannot be read.
    """
    try:
        if (kept := cache.recall(path)) is not None:
            return kept
    except OSError as error:
        raise BadConfigFile(f"cannot read {path}: {error.strerror or error}") from None
    with tempfile.TemporaryDirectory(prefix="pipros_cfg_") as folder:
        output = Path(folder) / "declared.json"
        # The genuine generator passes four arguments, and some old files check their number.
        arguments = [sys.executable, str(path), folder, folder, folder, folder]
        environment = {**DISTRIBUTION, **os.environ, OUTPUT_VARIABLE: str(output)}
        code, errors = _run(arguments, environment, time_limit_s)
        if code is None:
            raise BadConfigFile(f"{path} did not finish within {time_limit_s:g} s")
        if not output.exists():
            errors = errors or "it did not call generate()"
            raise BadConfigFile(f"{path} declared no parameters (exit code {code}):\n{errors}")
        try:
            declared = checked_declarations(read_file(output))
        except OSError as error:
            raise BadConfigFile(f"cannot read the declarations of {path}: {error.strerror}") from None
        except (ValueError, RecursionError) as error:
            raise BadConfigFile(f"the declarations of {path} are malformed: {error}") from None
    if cache.SOURCES in declared:
        cache.keep(path, declared)
    return declared


def _run(arguments: list[str], environment: dict[str, str], limit_s: float) -> tuple[int | None, str]:
    """Run the user's program.

    Return its exit code (None if it exceeded the time limit) and the end of its stderr. Kill the processes
    that it has started.
    """
    process = subprocess.Popen(  # noqa: S603
        arguments,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
        creationflags=NEW_GROUP,
    )
    captured = b""

    def read_errors() -> None:
        nonlocal captured
        assert isinstance(process.stderr, io.BufferedReader)  # noqa: S101 # a pipe
        with process.stderr as errors:
            while chunk := errors.read1(65536):
                captured = (captured + chunk)[-4 * _SHOWN_CHARACTERS :]

    reader = threading.Thread(target=read_errors, daemon=True)
    reader.start()
    try:
        code: int | None = process.wait(limit_s)
    except subprocess.TimeoutExpired:
        code = None
    finally:
        kill_with_group(process)
        _end_daemons(f"{OUTPUT_VARIABLE}={environment[OUTPUT_VARIABLE]}")
        process.wait()
        reader.join(_READ_S)
    return code, captured.decode("utf-8", "replace").strip()[-_SHOWN_CHARACTERS:]


def _end_daemons(variable: str) -> None:
    """On Linux, kill the processes that left the process group, identified by an environment variable.

    Do nothing on other systems.
    """
    if sys.platform != "linux":
        return
    wanted = os.fsencode(variable)
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # the process has ended, or belongs to another user
            if wanted in (folder / "environ").read_bytes().split(b"\0"):
                os.kill(int(folder.name), signal.SIGKILL)


def checked_declarations(content: bytes) -> dict[str, Any]:
    """Parse and check declarations, which any program may have written.

    Raises:
        ValueError: the declarations are malformed.
        RecursionError: the declarations are nested too deeply.
    """
    declared = json.loads(content)
    if not _has(declared, name=str, description=object, constants=list):
        raise ValueError("must be an object with name, description and constants")
    if not all(_has(constant, name=str, value=object) for constant in declared["constants"]):
        raise ValueError("a constant must have a name and a value")
    groups = [(0, declared["description"])]
    while groups:
        depth, group = groups.pop()
        if depth > _DEPTH_LIMIT:
            raise ValueError(f"groups are nested more than {_DEPTH_LIMIT} deep")
        if not _has(group, **_GROUP):
            raise ValueError(f"a group must have {', '.join(_GROUP)}")
        for parameter in group["parameters"]:
            if not _has(parameter, **_PARAMETER):
                raise ValueError(f"a parameter must have {', '.join(_PARAMETER)}")
        inner = group["groups"]
        groups += ((depth + 1, each) for each in (inner.values() if isinstance(inner, dict) else inner))
    return declared  # type: ignore[no-any-return]  # checked above to be a dictionary


def _has(value: object, /, **fields: _Kinds) -> bool:
    """Return whether a value is a dictionary with the given keys and value types."""
    return isinstance(value, dict) and all(
        key in value and isinstance(value[key], kind) for key, kind in fields.items()
    )


def parameters(group: dict[str, Any]) -> list[dict[str, Any]]:
    """Return all parameters in a group and its subgroups. The subgroups may be a list or a dictionary."""
    found = list(group["parameters"])
    inner = group["groups"]
    for each in inner.values() if isinstance(inner, dict) else inner:
        found += parameters(each)
    return found


def module_contents(declared: dict[str, Any]) -> dict[str, Any]:
    """Return the contents of a configuration's module, such as `my_pkg.cfg.FooConfig`."""
    description = declared["description"]
    every = parameters(description)
    contents: dict[str, Any] = {"config_description": description, "inf": float("inf"), "all_level": 0}
    for name, field in (
        ("min", "min"),
        ("max", "max"),
        ("defaults", "default"),
        ("level", "level"),
        ("type", "type"),
    ):
        contents[name] = {parameter["name"]: parameter[field] for parameter in every}
    for parameter in every:
        contents["all_level"] |= parameter["level"]
    for constant in declared["constants"]:
        contents[f"{declared['name']}_{constant['name']}"] = constant["value"]
    return contents
