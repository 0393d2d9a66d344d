"""Command-line arguments and parameters that affect how a node starts."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

from pipros.basics.names import is_legal_remapping
from pipros.node.node import Node

if TYPE_CHECKING:
    from pipros.node.topic_statistics import WindowLimits

_WINDOW_PARAMETERS = {
    "min_elements": "/statistics_window_min_elements",
    "max_elements": "/statistics_window_max_elements",
    "min_size_s": "/statistics_window_min_size",
    "max_size_s": "/statistics_window_max_size",
}


def set_private_params(node: Node, *, keep_texts: bool = False) -> None:
    """Set the private parameters from arguments of the form `_name:=yaml`; none if one is not valid YAML.

    With `keep_texts`, a value that is no YAML, or that XML-RPC cannot represent, is a text, as in roscpp.

    Raises:
        YamlError: a value is not valid YAML.
        TypeError, OverflowError, ValueError: XML-RPC cannot represent a value.
        Unreachable: the master does not answer.
        Refused: the master refuses a value.
    """
    given = node.identity.arguments.params
    if not given:
        return
    from pipros.safe import yaml

    texts = (TypeError, OverflowError, ValueError) if keep_texts else ()
    values = dict(given)
    for key, text in given.items():
        with contextlib.suppress(*texts):
            values[key] = yaml.load(text)
    for key, value in values.items():
        try:
            node.params.set("~" + key, value)
        except texts:
            node.params.set("~" + key, given[key])


def check_remappings(node: Node) -> None:
    """Raise ValueError if an argument is no remapping because it contains `:=` more than once."""
    for argument in filter(is_legal_remapping, node.identity.arguments.malformed):
        raise ValueError(f"[{argument}] contains := more than once")


def is_on(node: Node, switch: str) -> bool:
    """Return True if a parameter such as `/use_sim_time` or `/enable_statistics` is set to true."""
    try:
        return node.params.get(switch) is True
    except LookupError:
        return False


def window_limits(node: Node) -> WindowLimits:
    """Return the window limits for topic statistics from the parameters.

    Unset and invalid parameters are replaced by defaults.
    """
    from pipros.node.topic_statistics import WindowLimits

    given: dict[str, Any] = {}
    for field, parameter in _WINDOW_PARAMETERS.items():
        with contextlib.suppress(LookupError):
            value = node.params.get(parameter)
            if isinstance(value, (int, float)) and value > 0:
                given[field] = value
    return WindowLimits(**given)
