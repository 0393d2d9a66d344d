"""`rosdep`: checks and installs a workspace's dependencies from PyPI. A genuine rosdep takes precedence."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.interrupts import forget_handlers
from pipros_tools.cli.entry_point import command

if TYPE_CHECKING:
    from pipros_wheels.plan import PlanStep

_OUTPUT_LIMIT_S = 10.0


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run a genuine rosdep if there is one; otherwise use the table of Python keys.

    Return the exit code, which is 1 after an error, or if `check` finds missing dependencies.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    _run_genuine(arguments)
    options = _parser().parse_args(arguments)
    if options.verb in ("init", "update"):
        print("nothing to do: the table of Python keys comes with pipros")
        return 0
    from pipros_wheels.plan import Places, Provider, make_plan
    from pipros_wheels.python_keys import read_keys
    from pipros_wheels.wheel_build import source_packages

    try:
        keys = read_keys(options.keys)
        space = source_packages(options.from_paths or [Path.cwd()])
        for error in space.errors:
            print(f"rosdep: {error}", file=sys.stderr)
        plan = make_plan(space.packages, Places((), None, keys), [])
        needed = [step for step in plan if step.provider is not Provider.SOURCE]
        code = _carry_out(options, needed)
    except (PiprosError, OSError) as error:
        print(f"rosdep: {error}", file=sys.stderr)
        return 1
    return 1 if space.errors else code


def _carry_out(options: Namespace, needed: Sequence[PlanStep]) -> int:
    from pipros_wheels.plan import Provider

    if options.verb == "keys":
        print("\n".join(step.name for step in needed))
        return 0
    missing = [step for step in needed if step.provider is Provider.PYPI and not _is_installed(step.target)]
    others = [step for step in needed if step.provider in (Provider.DEBIAN, Provider.UNKNOWN)]
    if options.verb == "check":
        return _check([*missing, *others])
    for step in others:
        print(f"{step.name}: {step.provider.value} {step.target}".rstrip())
    _install(list(dict.fromkeys(step.target for step in missing)), is_simulated=options.simulate)
    return 0


def _check(unsatisfied: Sequence[PlanStep]) -> int:
    from pipros_wheels.plan import plan_table

    if not unsatisfied:
        print("All system dependencies have been satisfied")
        return 0
    print("System dependencies have not been satisfied:")
    print("\n".join(plan_table(unsatisfied)))
    return 1


def _install(requirements: Sequence[str], *, is_simulated: bool) -> None:
    if not requirements:
        print("#All required rosdeps installed successfully")
        return
    if is_simulated:
        print(f"pip install {' '.join(requirements)}")
        return
    from pipros_wheels.installer import Installer, find_installer

    Installer(find_installer()).install(requirements, {})


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        prog="rosdep",
        description="Answers from pipros's table of Python keys: check lists what is missing, keys lists all "
        "dependencies, install installs Python projects with pip. Debian's packages are only listed; init "
        "and update do nothing.",
    )
    parser.add_argument("verb", choices=("check", "init", "install", "keys", "update"))
    parser.add_argument("--from-paths", type=Path, nargs="+", default=[], metavar="DIR")
    parser.add_argument("--keys", metavar="FILE", help="YAML file that maps rosdep keys to requirements")
    parser.add_argument("-s", "--simulate", action="store_true", help="print the command, and do nothing")
    # Scripts pass these options to genuine rosdep. Packages in the given folders are always omitted.
    for names in (("-i", "--ignore-src"), ("-y", "--default-yes"), ("-r",), ("-q", "--quiet")):
        parser.add_argument(*names, action="store_true", help="accepted, without effect")
    parser.add_argument("--rosdistro", metavar="NAME", help="accepted, without effect")
    return parser


def _is_installed(requirement: str) -> bool:
    import re
    from importlib.metadata import PackageNotFoundError, distribution

    name = re.match(r"[\w.-]+", requirement)
    try:
        distribution(name[0] if name else requirement)
    except PackageNotFoundError:
        return False
    return True


def _run_genuine(arguments: Sequence[str]) -> None:
    """Replace this process with a genuine rosdep, from PyPI or Debian, if there is one."""
    if importlib.util.find_spec("rosdep2") is not None:
        code = "import sys; from rosdep2.main import rosdep_main; sys.exit(rosdep_main())"
        _become([sys.executable, "-c", code, *arguments])
    this_program = os.path.realpath(sys.argv[0])
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        program = os.path.join(folder, "rosdep")
        if not os.access(program, os.X_OK) or os.path.realpath(program) == this_program or _is_ours(program):
            continue
        _become([program, *arguments])


def _become(words: list[str]) -> None:
    """Replace this process with a program.

    If `sys.stdout` was replaced, run the program, print its output to `sys.stdout`, and exit. Completion uses
    this to read the options from the help.
    """
    if sys.stdout is sys.__stdout__:
        forget_handlers()
        os.execv(words[0], words)  # noqa: S606
    try:
        ended = subprocess.run(words, capture_output=True, text=True, timeout=_OUTPUT_LIMIT_S, check=False)  # noqa: S603
    except subprocess.TimeoutExpired:
        sys.exit(f"rosdep: {words[0]} did not finish within {_OUTPUT_LIMIT_S:.0f} s")
    print(ended.stdout, end="")
    sys.exit(ended.returncode)


def _is_ours(program: str) -> bool:
    try:
        with open_file(program) as file:
            return b"pipros" in file.read(2000)
    except OSError:
        return True
