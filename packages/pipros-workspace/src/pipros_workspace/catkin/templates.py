"""Expand empy 3 templates (`x.cmake.em`, `x.sh.em`), and run the command `em_expand()`.

Templates contain Python code. A separate process of the same interpreter expands them with the module `em`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from pipros.basics.env import DISTRIBUTION
from pipros.basics.extras import install_command
from pipros.basics.replaced_file import write_whole
from pipros_workspace.catkin.context import Handler, ReadContext
from pipros_workspace.cmake.configure import configure_file
from pipros_workspace.cmake.language import Command

_TIME_LIMIT_S = 60.0
_PREFIXES = ("CATKIN_", "CMAKE_", "PROJECT_", "PYTHON_")


def needs_empy() -> str:
    """Return the part of an error text that explains how to install empy."""
    return f"needs empy 3 ({install_command('templates')})"


def can_expand() -> bool:
    """Return whether empy 3 is installed. The template language of version 4 is incompatible."""
    try:
        return version("empy").startswith("3.")
    except PackageNotFoundError:
        return False


def expanded(template: str, context: ReadContext, *, is_installed: bool = False) -> str:
    """Expand a package's template with catkin's variables for environment hooks and CFG_EXTRAS.

    Blocks for at most one minute while a separate process expands the template.

    Args:
        is_installed: whether to expand for the install space instead of the devel space.

    Raises:
        ValueError: the expansion failed or took too long.
    """
    values = context.scope.values
    variables: dict[str, object] = {
        key: values[key] for key in values if key.startswith(_PREFIXES) and key.isidentifier()
    }
    variables |= extra_variables(context, is_installed=is_installed)
    with tempfile.TemporaryDirectory(prefix="pipros_em_") as folder:
        file = Path(folder, "context.py")
        file.write_text("".join(f"{key} = {value!r}\n" for key, value in variables.items()), "utf-8")
        return _run(template, str(file), context.scope.environment)


def extra_variables(context: ReadContext, *, is_installed: bool) -> dict[str, str | bool]:
    """Return catkin's variables for templates of the devel or the install space."""
    devel = f"{context.scope.values.get('CATKIN_DEVEL_PREFIX', '')}/share/{context.project.name}/cmake"
    folder = f"${{{context.project.name}_DIR}}" if is_installed else devel
    return {"DEVELSPACE": not is_installed, "INSTALLSPACE": is_installed, "PKG_CMAKE_DIR": folder}


def _run(template: str, definitions: str, environment: Mapping[str, str]) -> str:
    """Return the expanded template. The Python file `definitions` sets the template's variables."""
    command = [sys.executable, "-m", "em", "--raw-errors", "-F", definitions, template]
    try:
        ended = subprocess.run(  # noqa: S603
            command,
            env={**DISTRIBUTION, **environment},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_TIME_LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ValueError(f"the template {template} did not finish within {_TIME_LIMIT_S:.0f} s") from None
    if ended.returncode != 0:
        last_lines = ended.stderr.decode("utf-8", "replace").strip().splitlines()[-3:]
        reason = "\n  ".join(last_lines) or f"it ended with exit status {ended.returncode}"
        raise ValueError(f"the template {template} failed:\n  {reason}")
    return ended.stdout.decode("utf-8", "replace")


def _em_expand(context: ReadContext, command: Command, words: list[str]) -> None:
    if len(words) != 4:
        raise ValueError("em_expand() called with incorrect number of arguments, expected 4")
    scope = context.scope
    definitions, template, target = (
        scope.in_binary(words[1]),
        scope.in_source(words[2]),
        scope.in_binary(words[3]),
    )
    for file in (scope.in_source(words[0]), template):
        if not os.path.isfile(file):
            raise ValueError(f"em_expand() was given a file that does not exist: {file}")
    if not can_expand():
        context.need_native_build(command, f"expands the template {template}, which {needs_empy()}")
        return
    configure_file([words[0], words[1], "@ONLY"], scope)
    write(target, _run(template, definitions, scope.environment))


def write(file: str, text: str) -> None:
    """Write a file, creating its parent folders. Raise ValueError if that fails."""
    try:
        Path(file).parent.mkdir(parents=True, exist_ok=True)
        write_whole(Path(file), text.encode())
    except OSError as error:
        raise ValueError(f"{error.filename}: {error.strerror}") from None


COMMANDS: Mapping[str, Handler] = {"em_expand": _em_expand}
