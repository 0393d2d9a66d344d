"""Convert messages to and from YAML."""

from __future__ import annotations

from typing import Any

from yaml import safe_dump

import roslib.packages
import rospy
from pipros.basics.input_file import read_text
from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.base import Message
from pipros.msg.from_yaml import fill_message_args
from pipros.safe.yaml import load

_star_names(__name__, "sys yaml")


def findros(pkg: str, resource: str) -> str:
    """Return the path of a file in a package.

    Raises:
        ROSException: the file does not exist.
        rospkg.ResourceNotFound: the package does not exist.
    """
    found = roslib.packages.find_resource(pkg, resource)
    if not found:
        raise rospy.ROSException(f"cannot find resource: {resource} in the package {pkg}")
    return str(found[0])


def to_yaml(obj: Any) -> str:
    """Return a message, or plain data, as YAML."""
    return str(obj) if isinstance(obj, Message) else str(safe_dump(obj))


def yaml_msg_str(type_: Any, yaml_str: str, filename: str | None = None) -> Any:
    """Return a message of class `type_` with the fields of a YAML mapping. Missing fields get default values.

    Raises:
        ValueError: the text is not a mapping.
        genpy.MessageException: a field is unknown, or its value is invalid.
    """
    return _message_from(type_, {} if not yaml_str.strip() else load(yaml_str), filename, "a dictionary")


def yaml_msg(type_: Any, filename: str) -> Any:
    """Like `yaml_msg_str`, but read the YAML from a file."""
    return yaml_msg_str(type_, read_text(filename), filename)


def yaml_msgs_str(type_: Any, yaml_str: str, filename: str | None = None) -> list[Any]:
    """Return a list of messages of class `type_` from a YAML list of mappings.

    Raises:
        ValueError: the text is not a list of mappings.
        genpy.MessageException: a field is unknown, or its value is invalid.
    """
    values = load(yaml_str)
    if not isinstance(values, list):
        values = [None]
    return [_message_from(type_, value, filename, "a list of dictionaries") for value in values]


def yaml_msgs(type_: Any, filename: str) -> list[Any]:
    """Like `yaml_msgs_str`, but read the YAML from a file."""
    return yaml_msgs_str(type_, read_text(filename), filename)


def _message_from(type_: Any, values: Any, filename: str | None, wanted: str) -> Any:
    if not isinstance(values, dict):
        where = f"yaml file [{filename}]" if filename else "yaml string"
        raise ValueError(f"{where} does not contain {wanted}")
    message = type_()
    fill_message_args(message, [values])
    return message
