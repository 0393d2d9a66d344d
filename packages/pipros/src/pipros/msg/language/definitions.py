"""Parsed definitions from the files of ROS packages."""

from __future__ import annotations

import os

from pipros.basics.input_file import read_text
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.full_text import DEFINITION_BYTES
from pipros.msg.language.parse import parse_action, parse_message, parse_service
from pipros.msg.language.spec import ActionSpec, DefinitionError, MessageSpec, ServiceSpec


class Definitions:
    """Interface definitions, looked up by type.

    Messages and services are cached. An unknown package or type raises `NotFound`.
    """

    def __init__(self, files: DefinitionFiles) -> None:
        self.files = files
        self._messages: dict[str, MessageSpec] = {}
        self._services: dict[str, ServiceSpec] = {}

    def message(self, type_name: str) -> MessageSpec:
        """Return the definition of `package/Name`, from a `.msg` file or the `.action` file that contains it.

        Raises:
            NotFound: the package or the file does not exist.
            DefinitionError: the file is invalid or cannot be read.
        """
        if type_name not in self._messages:
            file = self.files.file("msg", type_name)
            if file.endswith(".action"):
                action_type = type_name.partition("/")[0] + "/" + _stem(file)
                for spec in parse_action(_read(file), action_type, file).messages:
                    self._messages.setdefault(spec.type, spec)
            else:
                self._messages[type_name] = parse_message(_read(file), type_name, file)
        return self._messages[type_name]

    def service(self, type_name: str) -> ServiceSpec:
        """Return the definition of the service `package/Name`. Raises the same errors as `message`."""
        if type_name not in self._services:
            file = self.files.file("srv", type_name)
            self._services[type_name] = parse_service(_read(file), type_name, file)
        return self._services[type_name]

    def action(self, type_name: str) -> ActionSpec:
        """Return the definition of the action `package/Name`. Raises the same errors as `message`."""
        file = self.files.file("action", type_name)
        return parse_action(_read(file), type_name, file)


def _read(file: str) -> str:
    try:
        return read_text(file, DEFINITION_BYTES)
    except (OSError, UnicodeDecodeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise DefinitionError(f"the file cannot be read: {reason}", file=file) from None


def _stem(file: str) -> str:
    return os.path.splitext(os.path.basename(file))[0]
