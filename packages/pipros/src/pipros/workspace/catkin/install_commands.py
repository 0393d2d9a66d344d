"""CMake commands that declare files to install."""

from __future__ import annotations

import os
from collections.abc import Mapping

from pipros.cmake.language import Command
from pipros.workspace.catkin.context import Handler, ReadContext
from pipros.workspace.catkin.installation import read_installations


def _install(context: ReadContext, command: Command, words: list[str]) -> None:
    is_python = command.name == "catkin_install_python"
    project = context.project
    found = read_installations(words, context.scope, is_python=is_python, place=context.place(command))
    for item in found:
        is_made = item.source in project.steps.rules or item.source.startswith(project.binary)
        if is_python and not is_made and not os.path.isfile(item.source):
            raise context.error(command, f"catkin_install_python() cannot find the script {item.source}")
    project.installations += found


COMMANDS: Mapping[str, Handler] = {"install": _install, "catkin_install_python": _install}
