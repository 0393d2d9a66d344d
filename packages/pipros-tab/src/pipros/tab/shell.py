"""A small shell for the terminals of a tab: one line of built-in commands and programs.

It knows quotes, `$NAME`, `$?`, `~`, `*`, `;`, `&&`, `&`, and `>` and `>>` at the end of a command.
`source` sets what the setup file of a built workspace sets, and runs the lines of other files. Everything
else is a program.
"""

from __future__ import annotations

import contextlib
import glob
import os
import re
import shlex
import shutil
import stat
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Protocol

MISUSE: Final = 2
_SEPARATORS: Final = (";", "&&", "&")
_SOURCES: Final = ("source", ".")
_NOT_HERE: Final = ("|", "||", "<", "<<", "<<<", ">&", "&>")
_REDIRECTIONS: Final = {">": "w", ">>": "a"}
_VARIABLE: Final = re.compile(r"\$(?:\{(\w+)\}|(\w+|\?))")
_last: Final = {"?": "0"}
"""The exit code of the last command."""


class Run(Protocol):
    """Starts a program."""

    def __call__(self, words: list[str], output: str | None = None, /, *, waits: bool = True) -> int:
        """Return the exit code, or 0 at once if `waits` is False. Append its output to a file, if given."""


def run_line(line: str, run: Run) -> int:
    """Run a line in this process's folder and environment, and return its exit code.

    Args:
        run: starts a program; see `Run`.
    """
    try:
        lexer = shlex.shlex(line, posix=False, punctuation_chars=";&>|<")
        lexer.whitespace_split = True
        words = list(lexer)
    except ValueError as error:
        return _misuse(str(error))
    for word in words:
        if word in _NOT_HERE:
            return _misuse(f"{word} is not available in a browser tab")
    code = 0
    while words:
        end = next((at for at, word in enumerate(words) if word in _SEPARATORS), len(words))
        separator = words[end] if end < len(words) else ";"
        code = _run_command(words[:end], run, waits=separator != "&")
        _last["?"] = str(code)
        if code and separator == "&&":
            break
        words = words[end + 1 :]
    return code


def _misuse(reason: str) -> int:
    print(f"bash: {reason}", file=sys.stderr)
    _last["?"] = str(MISUSE)
    return MISUSE


def _run_command(words: Sequence[str], run: Run, *, waits: bool) -> int:
    name = words[0] if words else "bash"
    try:
        words, output = _redirection(words)
        name, *arguments = [part for word in words for part in _expanded(word)] or [""]
        built_in = BUILT_IN.get(name)
        if name in _SOURCES:
            return _source(arguments, run)
        if built_in is None:
            return run([name, *arguments], output, waits=waits) if name else 0
        if output is None:
            return built_in(arguments)
        with open(output, "a", encoding="utf-8") as file, contextlib.redirect_stdout(file):
            return built_in(arguments)
    except OSError as error:
        shown = f"bash: {name}" if name in ("cd", *_SOURCES) else name
        place = f"{shown}: {error.filename}" if error.filename else "bash"
        print(f"{place}: {error.strerror or error}", file=sys.stderr)
        return 1
    except ValueError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1


def _redirection(words: Sequence[str]) -> tuple[Sequence[str], str | None]:
    """Split `> FILE` or `>> FILE` from the end of a command. The file is emptied for `>`."""
    if len(words) < 3 or words[-2] not in _REDIRECTIONS:
        return words, None
    path = os.path.abspath(_expanded(words[-1])[0])
    open(path, _REDIRECTIONS[words[-2]], encoding="utf-8").close()
    return words[:-2], path


def _expanded(word: str) -> list[str]:
    """Return the arguments that a word stands for, with variables, `~` and `*` replaced, without quotes."""
    if word.startswith("'"):
        return [word.strip("'")]
    text = _VARIABLE.sub(lambda found: {**os.environ, **_last}.get(found[1] or found[2], ""), word)
    if '"' in text or "'" in text or "\\" in text:
        return shlex.split(text) or [""]
    text = os.path.expanduser(text)
    return (sorted(glob.glob(text)) or [text]) if "*" in text else [text]


def _ls(arguments: Sequence[str]) -> int:
    options = "".join(each[1:] for each in arguments if each.startswith("-"))
    paths = [each for each in arguments if not each.startswith("-")] or ["."]
    for path in paths:
        if not os.path.isdir(path):
            os.stat(path)
            names = [path]
        else:
            names = sorted(name for name in os.listdir(path) if "a" in options or not name.startswith("."))
            if len(paths) > 1:
                print(f"{path}:")
        if "l" in options:
            for name in names:
                about = os.stat(os.path.join(path, name) if name != path else path)
                print(stat.filemode(about.st_mode), f"{about.st_size:>8}", name)
        elif names:
            print("  ".join(names))
    return 0


def _cd(arguments: Sequence[str]) -> int:
    os.chdir(arguments[0] if arguments else os.path.expanduser("~"))
    return 0


def _pwd(_: Sequence[str]) -> int:
    print(os.getcwd())
    return 0


def _cat(arguments: Sequence[str]) -> int:
    for path in arguments:
        sys.stdout.write(Path(path).read_text(encoding="utf-8", errors="replace"))
    return 0


def _echo(arguments: Sequence[str]) -> int:
    print(*arguments)
    return 0


def _mkdir(arguments: Sequence[str]) -> int:
    for path in arguments:
        if path != "-p":
            Path(path).mkdir(parents="-p" in arguments, exist_ok="-p" in arguments)
    return 0


def _rm(arguments: Sequence[str]) -> int:
    options = "".join(each for each in arguments if each.startswith("-"))
    for path in arguments:
        if path.startswith("-") or ("f" in options and not os.path.lexists(path)):
            continue
        if "r" in options and os.path.isdir(path):
            shutil.rmtree(path)
        else:
            os.unlink(path)
    return 0


def _chmod(arguments: Sequence[str]) -> int:
    mode, *paths = arguments or ("",)
    if not (re.fullmatch(r"[0-7]{3}|[ugoa]*[+-][rwx]+", mode) and paths):
        print("Usage: chmod +x FILE..., chmod 755 FILE...", file=sys.stderr)
        return 1
    for path in paths:
        if mode.isdigit():
            os.chmod(path, int(mode, 8))
            continue
        who, sign, what = re.split("([+-])", mode)
        people = "ugo" if who in ("", "a") else who
        bits = sum(1 << "xwr".index(each) for each in set(what))
        bits = sum(bits << 3 * "ogu".index(person) for person in people)
        before = stat.S_IMODE(os.stat(path).st_mode)
        os.chmod(path, before | bits if sign == "+" else before & ~bits)
    return 0


def _export(arguments: Sequence[str]) -> int:
    for each in arguments:
        name, _, value = each.partition("=")
        os.environ[name] = value
    return 0


def _sources_and_target(arguments: Sequence[str]) -> tuple[Sequence[str], str]:
    """Split the arguments of a command, without its options.

    Raises:
        ValueError: there are fewer than two.
    """
    paths = [each for each in arguments if not each.startswith("-")]
    if len(paths) < 2:
        raise ValueError("missing file operand")
    return paths[:-1], paths[-1]


def _cp(arguments: Sequence[str]) -> int:
    sources, target = _sources_and_target(arguments)
    for path in sources:
        to = os.path.join(target, os.path.basename(path.rstrip("/"))) if os.path.isdir(target) else target
        if os.path.isdir(path) and set(arguments) & {"-r", "-R", "-a"}:
            shutil.copytree(path, to)
        else:
            shutil.copy(path, to)
    return 0


def _mv(arguments: Sequence[str]) -> int:
    sources, target = _sources_and_target(arguments)
    for path in sources:
        shutil.move(path, target)
    return 0


def _touch(arguments: Sequence[str]) -> int:
    for path in arguments:
        Path(path).touch()
    return 0


def _clear(_: Sequence[str]) -> int:
    sys.stdout.write("\033[2J")
    return 0


def _place(text: str, command: str) -> str:
    """Return the path of `PACKAGE` or `PACKAGE/PATH`, or, after a message, an empty text if there is none."""
    from pipros.workspace.index import PackageIndex

    name, _, rest = text.partition("/")
    package = PackageIndex.from_environment().get(name)
    if package is None:
        print(f"{command}: No such package/stack '{text}'", file=sys.stderr)
        return ""
    return os.path.join(package.path, rest)


def _roscd(arguments: Sequence[str]) -> int:
    place = _place(arguments[0] if arguments else "", "roscd")
    return _cd([place]) if place else 1


def _rosls(arguments: Sequence[str]) -> int:
    place = _place(arguments[0] if arguments else "", "rosls")
    return _ls([*arguments[1:], place]) if place else 1


def file_in_package(arguments: Sequence[str], command: str) -> str:
    """Return the path of a file by package and name, or, after a message, an empty text if there is none."""
    if len(arguments) < 2:
        raise ValueError("package and file name are needed")
    place = _place(arguments[0], command)
    with contextlib.suppress(NotImplementedError):  # an absolute path
        for path in sorted(Path(place).rglob(arguments[1])) if place else ():
            return str(path)
    print("That file does not exist in that package.", file=sys.stderr)
    return ""


def _roscp(arguments: Sequence[str]) -> int:
    if len(arguments) != 3:
        print("usage: roscp package filename target", file=sys.stderr)
        return 1
    path = file_in_package(arguments, "roscp")
    return _cp([path, arguments[2]]) if path else 1


def _roscat(arguments: Sequence[str]) -> int:
    path = file_in_package(arguments, "roscat")
    return _cat([path]) if path else 1


def _source(arguments: Sequence[str], run: Run) -> int:
    """Set the variables of a built workspace, or of pipros itself, as for /opt/ros/noetic; or run lines."""
    from pipros.workspace.environment import environment_changes
    from pipros.workspace.overlays import MARKER

    path = Path(arguments[0] if arguments else "").absolute()
    space = path.parent if path.exists() and (path.parent / MARKER).is_file() else None
    if space is None and not path.as_posix().startswith("/opt/ros/"):
        code = 0
        for line in path.read_text(encoding="utf-8").splitlines():
            if not line.lstrip().startswith("#"):
                code = run_line(line, run)
        return code
    for name, value in environment_changes(space, os.environ, extend=False).items():
        os.environ[name] = value
    return 0


BUILT_IN: Final[dict[str, Callable[[Sequence[str]], int]]] = {
    "cat": _cat,
    "cd": _cd,
    "chmod": _chmod,
    "clear": _clear,
    "cp": _cp,
    "echo": _echo,
    "export": _export,
    "ls": _ls,
    "mkdir": _mkdir,
    "mv": _mv,
    "pwd": _pwd,
    "rm": _rm,
    "roscat": _roscat,
    "roscd": _roscd,
    "roscp": _roscp,
    "rosls": _rosls,
    "touch": _touch,
}
