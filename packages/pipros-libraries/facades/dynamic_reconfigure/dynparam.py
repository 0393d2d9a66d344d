"""`rosrun dynamic_reconfigure dynparam`: list, read and change nodes' parameters."""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import Any, NoReturn

import rospy
from dynamic_reconfigure import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
    find_reconfigure_services,
)
from dynamic_reconfigure.client import Client
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.printable import listed, printable_lines
from pipros.basics.replaced_file import overwritten_file
from pipros.safe.yaml import load


class CommandParser(argparse.ArgumentParser):
    """Argument parser with Noetic's exit codes.

    The program exits with 1 if the command is missing or unknown, and with 2 on other usage errors.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._negative_number_matcher = re.compile(r"-\.?[0-9]")  # values such as -1e-3 are no options

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        is_about_command = "argument command:" in message or message.endswith("required: command")
        self.exit(1 if is_about_command else 2, f"{self.prog}: error: {message}\n")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the commands and their arguments."""
    made = CommandParser(prog="dynparam", description=__doc__)
    commands = made.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="list the nodes that can be configured")
    for name, help_text, more in (
        ("get", "print the configuration of a node", ()),
        ("set", "change parameters: a name and a value, or a YAML mapping", ("words",)),
        ("set_from_parameters", "set parameters from the private parameters of this program", ()),
        ("dump", "write the configuration of a node to a file", ("file",)),
        ("load", "set parameters from a file", ("file",)),
    ):
        command = commands.add_parser(name, help=help_text)
        command.add_argument("-t", "--timeout", type=float, help="seconds to wait for the node")
        command.add_argument("node")
        for argument in more:
            command.add_argument(argument, nargs="+" if argument == "words" else None)
    return made


def mapping_of(text: str, where: str) -> dict[str, Any]:
    """Parse a YAML mapping, and omit the key `groups`. Raise ValueError if the text is not a mapping."""
    try:
        value = load(text)
    except PiprosError as error:
        raise ValueError(f"cannot read {where}: {error}") from error
    if not isinstance(value, dict):
        raise ValueError(f"{where} must be a YAML mapping of names to values, got {text.strip()!r}")
    return {name: part for name, part in value.items() if name != "groups"}


def changes_of(options: Any) -> dict[str, Any]:
    """Return the changes requested by `set`, `load` or `set_from_parameters`.

    Raises:
        ValueError: the changes are invalid.
        OSError: the file cannot be read.
    """
    if options.command == "load":
        try:
            return mapping_of(read_text(options.file), options.file)
        except UnicodeDecodeError as error:
            raise ValueError(f"cannot read {options.file}: {error}") from None
    if options.command == "set_from_parameters":
        found = rospy.get_param("~", {})
        if not found:
            raise ValueError("no parameters found on parameter server")
        return dict(found)
    if len(options.words) == 1:
        return mapping_of(options.words[0], "the value")
    if len(options.words) == 2:
        return {options.words[0]: options.words[1]}
    raise ValueError("too many arguments: give a name and a value, or a YAML mapping")


def _run(options: Any) -> None:
    if options.command == "list":
        print("\n".join(map(listed, find_reconfigure_services())))
        return
    changes = None if options.command in ("get", "dump") else changes_of(options)
    client = Client(options.node, timeout=options.timeout)
    if changes is not None:
        client.update_configuration(changes)
        return
    config = client.get_configuration(timeout=options.timeout)
    if config is None:
        raise ValueError(f"couldn't get parameters from node {options.node}")
    if options.command == "get":
        print(dict(config))
    else:
        with overwritten_file(Path(options.file)) as file:
            file.write(_as_yaml(config).encode())


def main() -> int:
    """Run the command line, and return the exit code."""
    options = parser().parse_args(rospy.myargv()[1:])
    try:
        rospy.init_node("dynparam", anonymous=True, disable_signals=True)
        _run(options)
    except (ValueError, DynamicReconfigureParameterException, DynamicReconfigureCallbackException) as error:
        print(f"error updating parameters: {printable_lines(str(error))}", file=sys.stderr)
        return 1
    except (OSError, rospy.ROSException) as error:
        print(printable_lines(str(error)), file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def _as_yaml(config: Any) -> str:
    """Format the configuration as YAML, with one parameter per line.

    JSON values are valid YAML, except for some numbers.
    """
    lines = []
    for name, value in config.items():
        if name == "groups":
            continue
        text = json.dumps(value)
        if isinstance(value, float):
            text = {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}.get(repr(value), repr(value))
            if "." not in text:
                text = text.replace("e", ".0e")
        key = name if load(name) == name else json.dumps(name)  # an unquoted `on` would be a bool in YAML
        lines.append(f"{key}: {text}\n")
    return "".join(lines)
