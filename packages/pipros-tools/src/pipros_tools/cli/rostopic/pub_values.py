"""Create messages from YAML values on a command line."""

from __future__ import annotations

from collections.abc import Sequence
from optparse import OptionParser
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.base import Message
from pipros.safe.yaml import YamlError
from pipros_tools.cli.runner import CommandError
from pipros_tools.cli.yaml_args import value_of
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.message_from_yaml import message_from_yaml


def message_class_of(type_name: str) -> type[Message]:
    """Load the class of a message type.

    Raises:
        CommandError: the type does not exist or is invalid.
    """
    try:
        return load_message_class(type_name)
    except PiprosError:
        package = type_name.partition("/")[0]
        raise CommandError(
            f"invalid message type: {type_name}.\n"
            f"If this is a valid message type, perhaps you need to type 'rosmake {package}'"
        ) from None


def read_values(parser: OptionParser, words: Sequence[str]) -> list[Any] | None:
    """Parse the words of a command line, or return None if there are none. An empty word is an empty string.

    Exit with an error if a word is not valid YAML.
    """
    if not words:
        return None
    try:
        return [value_of(word) for word in words]
    except YamlError as error:
        parser.error(f"Argument error: {error}")


class MessageTemplate:
    """Template that creates messages of one class from values.

    The value `now` is replaced by the current time, and `auto` by a header with that time.
    """

    def __init__(self, message_class: type[Message]) -> None:
        self._message_class = message_class

    def fill(self, values: Sequence[Any], now_ns: int) -> Message:
        """Create a message from the values.

        Raises:
            CommandError: there are too many or too few values, or a field is unknown or has the wrong type.
        """
        try:
            return message_from_yaml(self._message_class, list(values), now_ns)
        except GraphError as error:
            raise CommandError(str(error)) from None
