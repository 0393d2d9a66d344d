"""CMake commands that declare messages, services, actions and `.cfg` files."""

from __future__ import annotations

import glob
import os
from collections.abc import Mapping

from pipros.basics.windows import relative_path
from pipros.cmake.language import Command
from pipros.cmake.words import sections
from pipros.workspace.catkin.context import Handler, ReadContext
from pipros.workspace.catkin.project import Interface

_KINDS = {"add_message_files": "msg", "add_service_files": "srv", "add_action_files": "action"}
_LANGUAGES = ("", "_py", "_cpp", "_lisp", "_eus", "_nodejs")


def _add_files(context: ReadContext, command: Command, words: list[str]) -> None:
    kind = _KINDS[command.name]
    options = sections(words, ("DIRECTORY", "FILES", "BASE_DIR"), ("NOINSTALL",))
    directory = (options["DIRECTORY"] or [kind])[0]
    folder = context.scope.in_source(directory)
    files = options["FILES"]
    if "FILES" not in words:
        files = sorted(os.path.basename(path) for path in glob.glob(os.path.join(folder, f"*.{kind}")))
    for file in files:
        path = os.path.join(folder, file)
        if not os.path.isfile(path):
            raise context.error(command, f"{command.name}() was given a file that does not exist: {path}")
        name = os.path.splitext(os.path.basename(file))[0]
        installed = None if "NOINSTALL" in words else directory
        context.project.interfaces.append(Interface(kind, name, path, installed))


def _generate_messages(context: ReadContext, command: Command, words: list[str]) -> None:
    project = context.project
    options = sections(words, ("DEPENDENCIES", "LANGS"))
    if project.has_catkin_package:
        raise context.error(command, "generate_messages() must be called before catkin_package()")
    project.generate_messages_line = command.line
    project.message_dependencies += options["DEPENDENCIES"]
    project.targets.update(f"{project.name}_generate_messages{language}" for language in _LANGUAGES)


def _dynamic_reconfigure(context: ReadContext, _command: Command, words: list[str]) -> None:
    project = context.project
    files = (context.scope.in_source(word) for word in words)
    project.config_files += [relative_path(file, project.folder) for file in files]
    project.has_reconfigure_options = True
    project.targets.add(f"{project.name}_gencfg")


COMMANDS: Mapping[str, Handler] = {
    **dict.fromkeys(_KINDS, _add_files),
    "generate_messages": _generate_messages,
    "generate_dynamic_reconfigure_options": _dynamic_reconfigure,
}
