"""CMake commands that define compiled and custom targets."""

from __future__ import annotations

from collections.abc import Mapping

from pipros.cmake.language import Command
from pipros.workspace.catkin.context import Handler, ReadContext


def _compiled_target(context: ReadContext, command: Command, words: list[str]) -> None:
    if words:
        context.project.targets.add(words[0])
    if not {"IMPORTED", "INTERFACE", "ALIAS"} & set(words[1:3]):
        target = words[0] if words else command.written_name
        context.need_native_build(command, f"compiles [{target}]", target)


def _custom_target(context: ReadContext, command: Command, words: list[str]) -> None:
    context.project.steps.add_target(words, context.scope, context.file, command.line)
    context.project.targets.add(words[0])


def _custom_command(context: ReadContext, command: Command, words: list[str]) -> None:
    context.project.steps.add_command(words, context.scope, context.file, command.line)


def _dependencies(context: ReadContext, _command: Command, words: list[str]) -> None:
    context.project.steps.add_dependencies(words)


COMMANDS: Mapping[str, Handler] = {
    "add_executable": _compiled_target,
    "add_library": _compiled_target,
    "add_custom_target": _custom_target,
    "add_custom_command": _custom_command,
    "add_dependencies": _dependencies,
}
