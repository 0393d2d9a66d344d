"""The program `nodelet`: runs nodelets in Python, or starts the genuine program for C++ plugins."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.interrupts import exits_after_ctrl_c, forget_handlers
from pipros.libraries.nodelets.as_node import run_alone
from pipros.libraries.nodelets.loader import FAILED, load, unload
from pipros.libraries.nodelets.manager import Manager
from pipros.node.roscpp_program import roscpp_program
from pipros.packages.nodelets import GENUINE, OURS, InvalidChoice, chosen, python_nodelet
from pipros.packages.system_packages import program
from pipros.workspace.compiled_nodelets import loadable_nodelets
from pipros.workspace.program_start import command_of, environment_of

USAGE = """nodelet usage:
nodelet load pkg/Type manager [--no-bond]  - Launch a nodelet of type pkg/Type on manager manager
nodelet standalone pkg/Type   - Launch a nodelet of type pkg/Type in a standalone node
nodelet unload name manager   - Unload a nodelet by name from manager
nodelet manager               - Launch a nodelet manager node"""

_WORDS = {"load": 3, "standalone": 2, "unload": 3, "manager": 1}


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand of `nodelet`. Return the exit code."""
    argv = sys.argv[1:] if argv is None else argv
    words = [word for word in argv if ":=" not in word]
    command = words[0] if words else ""
    if len(words) < _WORDS.get(command, len(words) + 1):
        print("Your usage: ", " ".join(sys.argv), USAGE, sep="\n")
        return FAILED
    try:
        choice = chosen()
    except InvalidChoice as error:
        print(f"nodelet: {error}", file=sys.stderr)
        return FAILED
    if choice == GENUINE or (choice != OURS and command == "standalone" and _is_only_compiled(words[1])):
        return _run_genuine(argv)
    return _run(words, argv)


def _run(words: Sequence[str], argv: Sequence[str]) -> int:
    command, *rest = words
    if command == "manager":
        with roscpp_program("manager", "nodelet", argv) as (node, log):
            Manager(node, log)
            node.wait_for_shutdown()
        return 0
    if command == "unload":
        with roscpp_program("nodelet_unloader", "nodelet", argv) as (node, log):
            return unload(node, log, rest[0], rest[1])
    name = rest[0].replace("/", "_")
    with roscpp_program(name, "nodelet", argv) as (node, log):
        if command == "standalone":
            return run_alone(node, log, rest[0], rest[1:])
        has_bond = rest[2:3] != ["--no-bond"]
        return load(node, log, rest[0], rest[1], rest[2 if has_bond else 3 :], has_bond=has_bond)


def _is_only_compiled(plugin: str) -> bool:
    return python_nodelet(plugin) is None and plugin in loadable_nodelets()


def _run_genuine(argv: Sequence[str]) -> int:
    """Replace this process with the genuine program. Return the exit code if the program is not installed."""
    found = program("nodelet", "nodelet")
    if found is None:
        print(
            "nodelet: the genuine program is not installed. Try: apt-get install libnodeletlib-tools",
            file=sys.stderr,
        )
        return FAILED
    sys.stdout.flush()
    command = command_of(Path(found), argv)
    forget_handlers()
    return os.execve(command[0], command, environment_of(Path(found), os.environ))  # noqa: S606  # no shell
