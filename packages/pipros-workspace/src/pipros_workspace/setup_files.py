"""Write the `setup.*` files in a devel or install space, for bash, zsh, sh, fish, PowerShell and cmd."""

from __future__ import annotations

import contextlib
import os
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros.basics.replaced_file import write_whole
from pipros.basics.windows import CONSOLE_ENCODING, ON_WINDOWS, console_path
from pipros_workspace.environment import (
    UNDERLAYS_FILE,
    quoted_for_fish,
    quoted_for_posix,
    quoted_for_powershell,
)
from pipros_workspace.overlays import MARKER

SHELL_FOLDER = Path(__file__).resolve().parent / "shell"

_OLDER_BY_S = 10

_COMPUTE = "from pipros_workspace.environment import main; main()"

_SH = """\
# Sets up this workspace's environment for the shell that sources this file. Created by pipros's catkin_make.
# Options: --extend keeps the workspaces that are already set up; --local omits this workspace's underlays.

_PIPROS_PREFIX={prefix}
[ -z "${{_CATKIN_SETUP_DIR:-}}" ] || _PIPROS_PREFIX=$_CATKIN_SETUP_DIR
unset _CATKIN_SETUP_DIR
_PIPROS_PYTHON={python}
[ -x "$_PIPROS_PYTHON" ] || _PIPROS_PYTHON=python3
_PIPROS_EXTEND=
_PIPROS_LOCAL=
case " $* ${{CATKIN_SETUP_UTIL_ARGS:-}} " in *" --extend "*) _PIPROS_EXTEND=--extend ;; esac
case " $* ${{CATKIN_SETUP_UTIL_ARGS:-}} " in *" --local "*) _PIPROS_LOCAL=--local ;; esac
eval "$("$_PIPROS_PYTHON" -I -c '{compute}' "${{CATKIN_SHELL:-sh}}" "$_PIPROS_PREFIX" \
  $_PIPROS_EXTEND $_PIPROS_LOCAL)"
unset _PIPROS_PREFIX _PIPROS_PYTHON _PIPROS_EXTEND _PIPROS_LOCAL
"""

_BASH = """\
#!/usr/bin/env bash
# Created by pipros's catkin_make.
# Tutorials tell all users to source setup.bash, but zsh has no BASH_SOURCE.
if [ -n "${{ZSH_VERSION:-}}" ]; then . "$(dirname "$0")/setup.zsh"; return; fi
CATKIN_SHELL=bash
_CATKIN_SETUP_DIR=$(builtin cd "$(dirname "${{BASH_SOURCE[0]}}")" > /dev/null && pwd)
. "$_CATKIN_SETUP_DIR/setup.sh"
[ -f {functions}/ros.bash ] && . {functions}/ros.bash
:
"""

_ZSH = """\
#!/usr/bin/env zsh
# Created by pipros's catkin_make.
CATKIN_SHELL=zsh
_CATKIN_SETUP_DIR=$(builtin cd -q "$(dirname "${{funcstack[1]:-${{(%):-%x}}}}")" > /dev/null && pwd)
emulate -R zsh -c 'source "$_CATKIN_SETUP_DIR/setup.sh"'
[ -f {functions}/ros.zsh ] && . {functions}/ros.zsh
:
"""

_FISH = """\
# Sets up the environment of this workspace for fish. Created by pipros's catkin_make.
set -l _pipros_python {python}
test -x $_pipros_python; or set _pipros_python python3
set -l _pipros_extend
contains -- --extend $argv; and set -a _pipros_extend --extend
contains -- --local $argv; and set -a _pipros_extend --local
set -l _pipros_file (realpath (status -f | string collect) | string collect)
$_pipros_python -I -c '{compute}' fish (dirname $_pipros_file | string collect) $_pipros_extend | source
test -f {functions}/ros.fish; and source {functions}/ros.fish
"""

_POWERSHELL = """\
# Sets up the environment of this workspace for PowerShell. Created by pipros's catkin_make.
$piprosPython = {powershell_python}
if (-not (Test-Path -LiteralPath $piprosPython)) {{ $piprosPython = 'python' }}
$piprosExtend = @($args | Where-Object {{ '--extend', '--local' -contains $_ }})
$piprosCode = & $piprosPython -I -c '{compute}' powershell $PSScriptRoot @piprosExtend | Out-String
if ($piprosCode) {{ Invoke-Expression $piprosCode }}
Remove-Variable 'piprosPython', 'piprosExtend', 'piprosCode'
"""

_CMD = """\
@rem Sets up the environment of this workspace for cmd. Created by pipros's catkin_make.\r
@for /f "usebackq delims=" %%i in (`call "{cmd_python}" -I -c "{compute}" cmd "%~dp0." %*`) do @set "%%i"\r
"""

_LOCAL = """\
# Sets up this workspace, and keeps those that are already set up. Created by pipros's catkin_make.
CATKIN_SETUP_UTIL_ARGS="--extend --local ${{CATKIN_SETUP_UTIL_ARGS:-}}"
. {setup}
unset CATKIN_SETUP_UTIL_ARGS
"""

_RELAYING = (
    "# Sets up the last package in this workspace, and thus all. Created by pipros's catkin_make_isolated.\n"
)

_ENV_SH = """\
#!/usr/bin/env sh
# Runs a command in the environment of this workspace. Created by pipros's catkin_make.
if [ $# -eq 0 ]; then
  echo "Usage: env.sh COMMANDS" >&2
  exit 1
fi
_PIPROS_COMMAND_DIR=$(cd "$(dirname "$0")" > /dev/null && pwd)
_CATKIN_SETUP_DIR=$_PIPROS_COMMAND_DIR
_pipros_setup() {{ . "$_PIPROS_COMMAND_DIR/setup.sh"; }}
_pipros_setup
exec "$@"
"""


def functions_code(shell: str) -> str:
    """Return shell code that defines `roscd`, completion and the other shell functions.

    `shell` is `sh`, `fish`, `powershell` or `cmd`. The code for `sh` defines the functions in bash and zsh
    only; for the last two, there is no code.
    """
    if shell == "fish":
        return f"source {quoted_for_fish(str(SHELL_FOLDER / 'ros.fish'))}\n"
    if shell != "sh":
        return ""
    bash, zsh = (quoted_for_posix(str(SHELL_FOLDER / f"ros.{name}")) for name in ("bash", "zsh"))
    return (
        f'if [ -n "${{BASH_VERSION:-}}" ] && [ -z "${{POSIXLY_CORRECT+set}}" ]; then . {bash}; '
        f'elif [ -n "${{ZSH_VERSION:-}}" ]; then . {zsh}; fi\n'
    )


def write_setup_files(prefix: Path, sources: Sequence[Path], underlays: Sequence[Path]) -> None:
    """Turn a folder into a workspace by writing the marker, the list of underlays and the setup files.

    Args:
        sources: the source folders for a devel space; empty for an install space.
        underlays: the workspaces on which the folder was built, topmost first.

    Raises:
        OSError: the folder cannot be written.
    """
    values = {
        "prefix": shlex.quote(str(prefix)),
        "python": shlex.quote(sys.executable),
        "cmd_python": _for_batch_file(sys.executable),
        "powershell_python": quoted_for_powershell(sys.executable),
        "compute": _COMPUTE,
        "functions": shlex.quote(str(SHELL_FOLDER)),
    }
    files = {
        "setup.sh": _SH,
        "setup.bash": _BASH,
        "setup.zsh": _ZSH,
        "setup.fish": _FISH,
        "setup.ps1": _POWERSHELL,
        "env.sh": _ENV_SH,
    }
    if ON_WINDOWS:
        files["setup.bat"] = _CMD
    prefix.mkdir(parents=True, exist_ok=True)
    write_if_changed(prefix / MARKER, ";".join(str(source) for source in sources))
    write_if_changed(prefix / UNDERLAYS_FILE, "".join(f"{folder}\0" for folder in underlays))
    for name, template in files.items():
        _write(prefix / name, template.format(**values))
    (prefix / "env.sh").chmod(0o755)
    for shell in ("sh", "bash", "zsh"):
        _write(
            prefix / f"local_setup.{shell}",
            _LOCAL.format(setup=shlex.quote(str(prefix / f"setup.{shell}"))),
        )


def _for_batch_file(path: str) -> str:
    return console_path(path).replace("%", "%%")


def write_relaying_setup_files(folder: Path, prefix: Path) -> None:
    """Write setup files to `folder` that source the setup files in `prefix`.

    Raises:
        OSError: the folder cannot be written.
    """
    for shell in ("sh", "bash", "zsh"):
        file = shlex.quote(str(prefix / f"setup.{shell}"))
        own = f"_CATKIN_SETUP_DIR={shlex.quote(str(prefix))}\n" if shell == "sh" else ""
        _write(folder / f"setup.{shell}", f"{_RELAYING}{own}. {file}\n")
    _write(folder / "setup.fish", f"{_RELAYING}source {shlex.quote(str(prefix / 'setup.fish'))} $argv\n")
    if ON_WINDOWS:  # without `call`, which would read % and ^ once more
        _write(folder / "setup.bat", f'@"{_for_batch_file(str(prefix / "setup.bat"))}" %*\r\n')
    script = quoted_for_powershell(str(prefix / "setup.ps1"))
    _write(folder / "setup.ps1", f"{_RELAYING}. {script} @args\n")
    _write(
        folder / "env.sh", f'#!/usr/bin/env sh\n{_RELAYING}exec {shlex.quote(str(prefix / "env.sh"))} "$@"\n'
    )
    (folder / "env.sh").chmod(0o755)


def _write(file: Path, content: str) -> None:
    """Write a setup file with an old modification time, so that genuine catkin can replace it.

    CMake does not copy a file whose timestamp differs by less than a second from that of the existing file.
    With the current time, a build with genuine catkin right afterwards would therefore not replace the file.
    """
    if write_if_changed(file, content):
        earlier = time.time() - _OLDER_BY_S
        os.utime(file, (earlier, earlier))


def write_if_changed(file: Path, content: str) -> bool:
    """Write a file unless it already has the given content. Return True if it was written."""
    data = content.encode(CONSOLE_ENCODING if file.suffix == ".bat" else "utf-8")
    with contextlib.suppress(OSError):
        if read_file(file) == data:
            return False
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, data)
    return True
