"""Compute the environment that a workspace's `setup.*` files set, and print it as shell code.

As in Noetic, the entries of previously sourced workspaces are removed, then this workspace and its underlays
are prepended, so sourcing twice changes nothing. With `--extend`, the old entries are kept.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Collection, Mapping, Sequence
from io import TextIOWrapper
from pathlib import Path

from pipros.basics.env import DISTRIBUTION
from pipros.basics.input_file import read_text
from pipros.basics.windows import CONSOLE_ENCODING, ON_WINDOWS, console_path
from pipros_workspace.hooks import FoundHook, find_hooks
from pipros_workspace.index import SHARED_PACKAGES, SHIPPED_FOLDERS
from pipros_workspace.overlays import MARKER, built_workspaces

_SEPARATORS = "/\\" if ON_WINDOWS else "/"

# The subfolder of a workspace that is added to each path variable.
_LISTS = {
    "CMAKE_PREFIX_PATH": "",
    "LD_LIBRARY_PATH": "lib",
    "PATH": "bin",
    "PKG_CONFIG_PATH": "lib/pkgconfig",
    "PYTHONPATH": "lib/python3/dist-packages",
}


def workspace_environment(
    prefix: Path | None,
    underlays: Sequence[Path],
    variables: Mapping[str, str],
    *,
    extend: bool = False,
    own_programs: Path | None = None,
) -> dict[str, str]:
    """Return the variables that change, with their new values.

    Args:
        prefix: the devel or install space; None for that of the packages that pipros ships.
        underlays: the workspaces on which `prefix` was built, topmost first.
        variables: the current environment.
        extend: whether to keep the entries of previously sourced workspaces, after the new entries.
        own_programs: a folder to put first in `PATH` unless `PATH` contains it.
    """
    removed = [] if extend else [workspace.prefix for workspace in built_workspaces(variables)]
    base = [folder.parent for folder in SHIPPED_FOLDERS]  # what stands in for /opt/ros/noetic
    added = base if prefix is None else [prefix, *(each for each in underlays if each != prefix)]
    changed: dict[str, str] = {}
    for name, below in _LISTS.items():
        entries = [entry for entry in variables.get(name, "").split(os.pathsep) if entry]
        if name == "CMAKE_PREFIX_PATH":
            entries = [entry for entry in entries if os.path.isdir(entry)]
        entries = _without(entries, {str(Path(folder, below)) for folder in removed})
        entries = _with_first(entries, [str(Path(folder, below)) for folder in added])
        if name == "PATH" and own_programs is not None and str(own_programs) not in entries:
            entries.insert(0, str(own_programs))
        if entries or variables.get(name):
            changed[name] = os.pathsep.join(entries)
    changed["ROS_PACKAGE_PATH"] = _package_path({**variables, **changed})
    changed |= DISTRIBUTION
    changed["ROS_ROOT"] = str(SHARED_PACKAGES / "ros")
    changed["ROS_ETC_DIR"] = str(SHARED_PACKAGES.parent / "etc" / "ros")
    changed.setdefault("ROS_MASTER_URI", variables.get("ROS_MASTER_URI") or "http://localhost:11311")
    return {name: value for name, value in changed.items() if variables.get(name) != value}


def _without(entries: Sequence[str], removed: Collection[str]) -> list[str]:
    return [entry for entry in entries if entry.rstrip(_SEPARATORS) not in removed]


def _with_first(entries: Sequence[str], folders: Sequence[str]) -> list[str]:
    """Return the entries after those of the folders that exist and are not among them."""
    present = {entry.rstrip(_SEPARATORS) for entry in entries}
    return [*(each for each in folders if os.path.isdir(each) and each not in present), *entries]


def _package_path(variables: Mapping[str, str]) -> str:
    """Return the value of `ROS_PACKAGE_PATH` for the workspaces in these variables."""
    folders: list[str] = []
    for workspace in built_workspaces(variables):
        folders += [str(source) for source in workspace.sources] or [str(workspace.prefix / "share")]
    return os.pathsep.join(dict.fromkeys([*folders, *map(str, SHIPPED_FOLDERS)]))


def underlays_of_build(variables: Mapping[str, str], prefix: Path) -> list[Path]:
    """Return the sourced workspaces other than `prefix`, which become its underlays."""
    return [workspace.prefix for workspace in built_workspaces(variables) if workspace.prefix != prefix]


def shell_code(changes: Mapping[str, str], shell: str) -> str:
    """Return commands that set the variables, for `sh` (also bash and zsh), `fish`, `powershell` or `cmd`.

    The lines for `cmd` are arguments of its command `set`.
    """
    write = {"fish": _fish, "powershell": _powershell, "cmd": "{}={}\n".format}.get(shell, _posix)
    kept = console_path if shell == "cmd" else str
    return "".join(write(name, kept(value)) for name, value in changes.items())


def hook_code(hooks: Sequence[FoundHook], shell: str) -> str:
    """Return commands that source hooks, with `CATKIN_ENV_HOOK_WORKSPACE` set to each hook's workspace.

    Hooks for `cmd` are not supported.
    """
    return "" if shell == "cmd" else "".join(_hook(hook, shell) for hook in hooks)


def _hook(hook: FoundHook, shell: str) -> str:
    workspace, file = str(hook.workspace), str(hook.file)
    if shell == "fish":
        set_workspace = f"set CATKIN_ENV_HOOK_WORKSPACE {quoted_for_fish(workspace)}"
        return f"{set_workspace}\nsource {quoted_for_fish(file)}\n"
    if shell == "powershell":
        set_workspace = f"$CATKIN_ENV_HOOK_WORKSPACE = {quoted_for_powershell(workspace)}"
        return f"{set_workspace}\n. {quoted_for_powershell(file)}\n"
    return f"CATKIN_ENV_HOOK_WORKSPACE={quoted_for_posix(workspace)}\n. {quoted_for_posix(file)}\n"


def _posix(name: str, value: str) -> str:
    return f"export {name}={quoted_for_posix(value)}\n"


def quoted_for_posix(text: str) -> str:
    return "'" + text.replace("'", "'\\''") + "'"


def _fish(name: str, value: str) -> str:
    return f"set -gx {name} {quoted_for_fish(value)}\n"


def quoted_for_fish(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _powershell(name: str, value: str) -> str:
    return f"$env:{name} = {quoted_for_powershell(value)}\n"


def quoted_for_powershell(text: str) -> str:
    """Return an expression with the value `text`, in ASCII: Windows PowerShell 5 reads other code pages.

    >>> print(quoted_for_powershell("it's"))
    'it''s'
    >>> print(quoted_for_powershell("B\u00e4r"))
    ('B'+[char]228+'r')
    """
    literal = "'" + text.replace("'", "''") + "'"
    if text.isascii():
        return literal
    return "(" + re.sub(r"[^\x00-\x7f]+", lambda match: f"'+{_characters(match[0])}+'", literal) + ")"


def _characters(text: str) -> str:
    units = memoryview(text.encode("utf-16-le", "surrogatepass")).cast("H")
    return "+".join(f"[char]{unit}" for unit in units)


def main(argv: Sequence[str] | None = None) -> None:
    """Print the shell code. The setup files call this with `shell prefix [--extend] [--local]`."""
    shell, folder, *options = sys.argv[1:] if argv is None else argv
    prefix, is_whole = Path(folder) if folder else None, "--local" not in options
    try:
        code = setup_code(prefix, os.environ, shell, extend="--extend" in options, with_underlays=is_whole)
    except OSError as error:
        sys.exit(f"setup: {error.filename}: {error.strerror}")
    print_code(code, shell)


def print_code(code: str, shell: str) -> None:
    """Print shell code with the line ends and the encoding that the shell reads from a pipe."""
    if isinstance(sys.stdout, TextIOWrapper) and not sys.stdout.isatty():
        if shell == "cmd":
            sys.stdout.reconfigure(encoding=CONSOLE_ENCODING)
        elif ON_WINDOWS:
            sys.stdout.reconfigure(newline="\n")
    print(code, end="")


def setup_code(
    prefix: Path | None,
    variables: Mapping[str, str],
    shell: str,
    *,
    extend: bool = False,
    with_underlays: bool = True,
) -> str:
    """Return the shell code of a devel or install space's setup file, including environment hooks."""
    changes = environment_changes(prefix, variables, extend=extend, with_underlays=with_underlays)
    workspaces = [workspace.prefix for workspace in built_workspaces({**variables, **changes})]
    return shell_code(changes, shell) + hook_code(find_hooks(workspaces, shell), shell)


def environment_changes(
    prefix: Path | None, variables: Mapping[str, str], *, extend: bool = False, with_underlays: bool = True
) -> dict[str, str]:
    """Return the result of `workspace_environment` for `prefix` and the underlays on which it was built."""
    underlays: list[Path] = []
    if prefix is not None and with_underlays:
        try:
            listed = read_text(prefix / UNDERLAYS_FILE).split("\0")
            underlays = [Path(entry) for entry in listed if entry and Path(entry, MARKER).is_file()]
        except OSError:
            pass  # no list of underlays was written, or the workspace was moved
    return workspace_environment(
        prefix, underlays, variables, extend=extend, own_programs=Path(sys.executable).parent
    )


UNDERLAYS_FILE = ".pipros_underlays"
"""File in a devel or install space that lists its underlays, each terminated by NUL."""
