"""What the definition files of ROS packages say."""

from __future__ import annotations

import os

from pipros.msg.files import DefinitionFiles
from pipros.msg.parse import parse_action, parse_message, parse_service
from pipros.msg.spec import ActionSpec, DefinitionError, MessageSpec, ServiceSpec

FILE_LIMIT_BYTES = 4 * 1024 * 1024
"""No definition is longer; a file that is was not meant as one."""


class Definitions:
    """Reads definition files, each of them once. An unknown package or type is a `NotFound`."""

    def __init__(self, files: DefinitionFiles) -> None:
        self.files = files
        self._messages: dict[str, MessageSpec] = {}
        self._services: dict[str, ServiceSpec] = {}

    def message(self, type_name: str) -> MessageSpec:
        """The definition of `package/Name`, from a `.msg` file or from the `.action` file behind it.

        Raises:
            NotFound: there is no such package or file.
            DefinitionError: the file breaks the rules.
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
        """The definition of the service `package/Name`; errors as for `message`."""
        if type_name not in self._services:
            file = self.files.file("srv", type_name)
            self._services[type_name] = parse_service(_read(file), type_name, file)
        return self._services[type_name]

    def action(self, type_name: str) -> ActionSpec:
        """The definition of the action `package/Name`; errors as for `message`."""
        file = self.files.file("action", type_name)
        return parse_action(_read(file), type_name, file)

    def mistakes(self, package: str) -> list[DefinitionError]:
        """All mistakes in the definitions of a package, those of types they embed among them.

        Raises:
            NotFound: there is no such package.
        """
        found: dict[str, DefinitionError] = {}
        for kind, source in (("msg", self._message_source), ("srv", self._service_source)):
            for name in self.files.names(kind, package):
                try:
                    source(f"{package}/{name}")
                except DefinitionError as mistake:
                    found |= {str(each): each for each in (mistake, *mistake.others)}
        return list(found.values())

    def _message_source(self, type_name: str) -> object:
        from pipros.msg.compiler import message_source

        return message_source(self.message(type_name), self.message)

    def _service_source(self, type_name: str) -> object:
        from pipros.msg.compiler import service_source

        return service_source(self.service(type_name), self.message)


def _read(file: str) -> str:
    try:
        with open(file, encoding="utf-8") as stream:
            text = stream.read(FILE_LIMIT_BYTES + 1)
    except (OSError, UnicodeDecodeError) as error:
        raise DefinitionError(f"cannot be read: {error}", file=file) from None
    if len(text) > FILE_LIMIT_BYTES:
        raise DefinitionError(f"is longer than {FILE_LIMIT_BYTES} bytes", file=file)
    return text


def _stem(file: str) -> str:
    return os.path.splitext(os.path.basename(file))[0]
