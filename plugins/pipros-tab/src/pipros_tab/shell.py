"""A small shell for the terminals of a tab: one line of built-in commands and programs.

It knows quotes, `$NAME`, `$?`, `~`, `*`, `;`, `&&`, `||`, `&`, `NAME=value` before a command,
`>` and `>>` at its end, and filters after `|` (`filters.py`). `source` sets what the setup file of a built
workspace sets, and runs the lines of other files. Everything else is a program.
"""

from __future__ import annotations

import contextlib
import functools
import glob
import io
import os
import re
import shutil
import stat
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from pipros_tab.filters import FILTERS, Pipe, complain, for_each, run_before, run_on_files

MISUSE: Final = 2
_SOURCES: Final = ("source", ".")
_SEPARATORS: Final = (";", "&&", "||", "&")
_REDIRECTIONS: Final = {">": "w", ">>": "a"}
_TOKEN: Final = re.compile(
    r"""\s*(\#.*|[12]>+&?|[;&|<>]+|(?:\\.|"[^"\\]*(?:\\.[^"\\]*){0,9999}"|'[^']*'|[^\s;&|<>"'\\]+){1,9999})\s*""",
    re.DOTALL,
)
_PART: Final = re.compile(r"""'([^']*)'|"([^"\\]*(?:\\.[^"\\]*){0,9999})"|\\(.)|([^"'\\]+)""", re.DOTALL)
_VARIABLE: Final = re.compile(r"(?<!\\)\$(?:\{(\w+|\?)\}|(\w+|\?))")
_ASSIGNMENT: Final = re.compile(r"([A-Za-z_]\w*)=(.*)", re.DOTALL)
_variables: Final = {"?": "0"}
"""The exit code of the last command, and variables that programs do not get."""


Run = Callable[..., int]
"""`run(words, output, waits=True, filters=())` starts a program. It returns the exit code, or 0 at once if it
does not wait. The output passes through the filters, and is appended to the file `output`, unless None."""


def run_line(line: str, run: Run) -> int:
    """Run a line in this process's folder and environment, and return its exit code.

    Args:
        run: starts a program; see `Run`.
    """
    words: list[str] = []
    at = 0
    while line[at:].strip():
        found = _TOKEN.match(line, at)
        if found is None:
            return _misuse(f"unexpected EOF while looking for matching `{line[at:].lstrip()[0]}'")
        word, at = found[1], found.end()
        is_operator = re.fullmatch(r"[12]?[;&|<>]+|[^']*\$\(.*", word, re.DOTALL)
        if is_operator and word not in (*_SEPARATORS, *_REDIRECTIONS, "|"):
            return _misuse(f"{word} is not available in a browser tab")
        words += [word] if not word.startswith("#") else []
    code, is_skipped = 0, False
    while words:
        end = next((at for at, word in enumerate(words) if word in _SEPARATORS), len(words))
        separator = words[end] if end < len(words) else ";"
        if not is_skipped:
            code = _run_command(words[:end], run, waits=separator != "&")
            _variables["?"] = str(code)
        is_skipped = code == 0 if separator == "||" else code != 0 and separator == "&&"
        words = words[end + 1 :]
    return code


def _misuse(reason: str) -> int:
    print(f"bash: {reason}", file=sys.stderr)
    _variables["?"] = str(MISUSE)
    return MISUSE


def _run_command(words: Sequence[str], run: Run, *, waits: bool) -> int:
    """Run a command, and the filters after it."""
    name = words[0] if words else "bash"
    try:
        words, output = _redirection(words)
        filters: list[list[str]] = []
        while "|" in words:
            at = len(words) - 1 - [*reversed(words)].index("|")
            filters.insert(0, _arguments(words[at + 1 :]) or [""])
            words, name = words[:at], filters[0][0]
            if name not in FILTERS:
                return _misuse(f"after |, a browser tab has only {', '.join(FILTERS)}, not {name}")
            Pipe(filters[0], io.StringIO())  # reports invalid options before anything runs
        assigned, words = _assignments(words)
        name, *arguments = _arguments(words) or [""]
        if not name:
            _variables.update(assigned)
            os.environ.update({each: value for each, value in assigned.items() if each in os.environ})
            return 0
        built_in = functools.partial(_source, run=run) if name in _SOURCES else BUILT_IN.get(name)
        with _in_environment_with(assigned):
            if built_in is None:
                return run([name, *arguments], output, waits=waits, filters=filters)
            with open(output or os.devnull, "a", encoding="utf-8") as file:
                out = file if output else sys.stdout
                return run_before(filters, functools.partial(built_in, arguments), out)
    except BrokenPipeError:
        return 0  # `head` needs no more lines
    except (OSError, ValueError) as error:
        complain(f"bash: {name}" if name in ("cd", *_SOURCES) else name, error)
        return 2 if name == "grep" else 1


def _assignments(words: Sequence[str]) -> tuple[dict[str, str], Sequence[str]]:
    """Split the assignments from the beginning of a command. A word `NAME=VALUE` is one."""
    assigned = {}
    while words and (found := _ASSIGNMENT.fullmatch(words[0])):
        assigned[found[1]] = "".join(_arguments([found[2]]) if found[2] else ())
        words = words[1:]
    return assigned, words


@contextlib.contextmanager
def _in_environment_with(assigned: Mapping[str, str]) -> Iterator[None]:
    """Set variables of this process. Afterwards, all are as before, if there were any to set."""
    before = dict(os.environ)
    os.environ.update(assigned)
    try:
        yield
    finally:
        if assigned:
            os.environ.clear()
            os.environ.update(before)


def _redirection(words: Sequence[str]) -> tuple[Sequence[str], str | None]:
    """Split `> FILE` or `>> FILE` from the end of a command. The file is emptied for `>`."""
    if len(words) < 3 or words[-2] not in _REDIRECTIONS:
        return words, None
    path = os.path.abspath(_expanded(words[-1])[0])
    open(path, _REDIRECTIONS[words[-2]], encoding="utf-8").close()
    return words[:-2], path


def _arguments(words: Sequence[str]) -> list[str]:
    return [part for word in words for part in _expanded(word)]


def _expanded(word: str) -> list[str]:
    """Return the arguments that a word stands for, with variables, `~` and `*` replaced, without quotes."""
    variables = {**os.environ, **_variables}
    substituted = functools.partial(_VARIABLE.sub, lambda found: variables.get(found[1] or found[2], ""))
    text = pattern = ""
    for single, double, escaped, plain in _PART.findall(word):
        quoted = single or escaped or re.sub(r"\\([\"\\$`])", r"\1", substituted(double))
        given = substituted(plain if text else os.path.expanduser(plain))
        text += quoted + given
        pattern += glob.escape(quoted) + given
    if word.startswith("$") and not text:
        return []
    return (sorted(glob.glob(pattern)) if "*" in pattern else []) or [text]


def _ls(arguments: Sequence[str]) -> int:
    options = "".join(each[1:] for each in arguments if each.startswith("-"))
    paths = [each for each in arguments if not each.startswith("-")] or ["."]

    def show(path: str) -> None:
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
            print(("\n" if isinstance(sys.stdout, Pipe) else "  ").join(names))

    return for_each("ls", paths, show)


def _cd(arguments: Sequence[str]) -> int:
    target = arguments[0] if arguments else os.path.expanduser("~")
    before = os.getcwd()
    if target == "-":
        if "OLDPWD" not in _variables:
            raise ValueError("OLDPWD not set")
        target = _variables["OLDPWD"]
        print(target)
    os.chdir(target)
    _variables["OLDPWD"] = before
    return 0


def _cat(arguments: Sequence[str]) -> int:
    def show(path: str) -> None:
        sys.stdout.write(Path(path).read_text(encoding="utf-8", errors="replace"))

    return for_each("cat", arguments, show)


def _echo(arguments: Sequence[str]) -> int:
    print(*arguments)
    return 0


def _which(names: Sequence[str]) -> int:
    """Print the files of programs, of which built-in commands have none."""
    modules = {each.name: each.module for each in entry_points(group="console_scripts")}
    specs = [find_spec(modules[name]) for name in names if name in modules]
    for spec in specs:
        print(spec.origin if spec else "")
    return 0 if specs and len(specs) == len(names) else 1


def _env(names: Sequence[str]) -> int:
    for name in sorted(os.environ.keys() & set(names or os.environ)):
        print(os.environ[name] if names else f"{name}={os.environ[name]}")
    return 0 if os.environ.keys() >= set(names) else 1


def _mkdir(arguments: Sequence[str]) -> int:
    paths = [path for path in arguments if path != "-p"]
    is_lenient = "-p" in arguments
    return for_each("mkdir", paths, lambda path: Path(path).mkdir(parents=is_lenient, exist_ok=is_lenient))


def _rm(arguments: Sequence[str]) -> int:
    options = "".join(each for each in arguments if each.startswith("-"))

    def remove(path: str) -> None:
        if "r" in options and os.path.isdir(path):
            shutil.rmtree(path)
        elif "f" not in options or os.path.lexists(path):
            os.unlink(path)

    return for_each("rm", [path for path in arguments if not path.startswith("-")], remove)


def _chmod(arguments: Sequence[str]) -> int:
    mode, *paths = arguments or ("",)
    changed = re.fullmatch("([ugoa]*)([+-])([rwx]+)", mode)
    if not (paths and (changed or re.fullmatch("[0-7]{3}", mode))):
        raise ValueError("use chmod +x FILE..., or chmod 755 FILE...")
    who, sign, what = changed.groups() if changed else ("", "", "")
    people = "ugo" if who in ("", "a") else who
    bits = sum(1 << 3 * "ogu".index(person) + "xwr".index(each) for person in people for each in set(what))

    def change(path: str) -> None:
        before = stat.S_IMODE(os.stat(path).st_mode)
        os.chmod(path, before | bits if sign == "+" else before & ~bits if sign else int(mode, 8))

    return for_each("chmod", paths, change)


def _export(arguments: Sequence[str]) -> int:
    for each in arguments:
        name, has_value, value = each.partition("=")
        os.environ[name] = value if has_value else {**os.environ, **_variables}.get(name, "")
    return 0


def _cp(arguments: Sequence[str], moves: bool = False) -> int:
    *sources, target = [each for each in arguments if not each.startswith("-")] or [""]
    if not sources:
        raise ValueError("missing file operand")

    def copy(path: str) -> None:
        to = os.path.join(target, os.path.basename(path.rstrip("/"))) if os.path.isdir(target) else target
        copies_folder = os.path.isdir(path) and set(arguments) & {"-r", "-R", "-a"}
        (shutil.move if moves else shutil.copytree if copies_folder else shutil.copy)(path, to)

    return for_each("mv" if moves else "cp", sources, copy)


def _touch(arguments: Sequence[str]) -> int:
    return for_each("touch", arguments, lambda path: Path(path).touch())


def _clear(_: Sequence[str]) -> int:
    sys.stdout.write("\033[2J")
    return 0


def _place(text: str, command: str) -> str:
    """Return the path of `PACKAGE` or `PACKAGE/PATH`, or, after a message, an empty text if there is none."""
    from pipros_workspace.index import PackageIndex

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
    path = file_in_package(arguments, "roscp")
    return _cp([path, *arguments[2:]]) if path else 1


def _roscat(arguments: Sequence[str]) -> int:
    path = file_in_package(arguments, "roscat")
    return _cat([path]) if path else 1


def _source(arguments: Sequence[str], run: Run) -> int:
    """Set the variables of a built workspace, or of pipros itself, as for /opt/ros/noetic; or run lines."""
    from pipros_workspace.environment import environment_changes
    from pipros_workspace.overlays import MARKER

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


_HELP: Final = """\
Files       ls  cd  pwd  mkdir  cp  mv  rm  cat  grep  chmod +x FILE; gedit FILE opens the editor
Packages    catkin_create_pkg  catkin_make  source FILE  roscd  rosls  rosmsg  rossrv
Programs    roscore  rosrun PACKAGE PROGRAM  roslaunch PACKAGE FILE  rostest; & at the end: in the background
Looking     rosnode  rostopic  rosservice  rosparam  rosbag; with a page: rqt_graph  rqt_plot  rqt_console
Ctrl-C ends a program, Tab completes a name, Up repeats a line. COMMAND -h explains most commands.
The steps of the case study are under Steps, beside the files."""


def _help(_: Sequence[str]) -> int:
    print(_HELP)
    return 0


def _install(_: Sequence[str]) -> int:
    print("a browser tab has nothing to install: ROS and its commands are here already", file=sys.stderr)
    return 1


BUILT_IN: Final[dict[str, Callable[[Sequence[str]], int]]] = {
    "cat": _cat,
    "cd": _cd,
    "chmod": _chmod,
    "clear": _clear,
    "cp": _cp,
    "date": lambda _: _echo([time.strftime("%a %b %d %H:%M:%S %Z %Y")]),
    "echo": _echo,
    "env": _env,
    "export": _export,
    "help": _help,
    "ls": _ls,
    "mkdir": _mkdir,
    "mv": functools.partial(_cp, moves=True),
    "printenv": _env,
    "pwd": lambda _: _echo([os.getcwd()]),
    "rm": _rm,
    "roscat": _roscat,
    "roscd": _roscd,
    "roscp": _roscp,
    "rosls": _rosls,
    "touch": _touch,
    "which": _which,
    "whoami": lambda _: _echo([os.environ.get("USER", "")]),
    **dict.fromkeys(("apt", "apt-get", "pip", "pip3", "sudo"), _install),
    **{name: functools.partial(run_on_files, name) for name in FILTERS},
}
