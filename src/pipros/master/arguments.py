"""What all methods of the Master API share: checks of their arguments, in the words of genuine rosmaster."""

from __future__ import annotations

import logging
import reprlib
from collections.abc import Callable
from typing import Any, Final

from pipros import names
from pipros.master.registry import ANY_TYPE

Answer = list[Any]

SUCCESS: Final = 1
INTERNAL: Final = 0
CALLER_ERROR: Final = -1

NAME_LIMIT: Final = 16 * 1024
"""Characters of a name or URI; to take megabytes of it apart would hold others up."""

_log = logging.getLogger("rosmaster.master")


class BadArgument(Exception):
    """The caller's error; its text goes back to the caller."""


def guarded(name: str, method: Callable[..., Answer], error_value: Any) -> Callable[..., Answer]:
    """`method` behind the checks of caller_id and number of arguments, and with its errors as answers.

    Calls are logged: those with bad arguments, and at level DEBUG all.
    """
    arity = method.__code__.co_argcount - 1  # without self

    def answer(*params: Any) -> Answer:
        if not params:
            return [CALLER_ERROR, "missing required caller_id parameter", error_value]
        if type(params[0]) is not str:
            return [CALLER_ERROR, "caller_id must be a string", error_value]
        if len(params[0]) > NAME_LIMIT:
            return [CALLER_ERROR, f"caller_id is longer than {NAME_LIMIT} characters", error_value]
        if len(params) != arity:
            return [CALLER_ERROR, "Error: bad call arity", error_value]
        try:
            return method(*params)
        except BadArgument as error:
            _log.info("%s: invalid parameter: %s", name, error)
            return [CALLER_ERROR, str(error), error_value]

    def logged_answer(*params: Any) -> Answer:
        result = answer(*params)
        if _log.isEnabledFor(logging.DEBUG):
            _log.debug("%s%s returns %s", name, reprlib.repr(params), reprlib.repr(result))
        return result

    return logged_answer


def resolved(parameter: str, name: Any, caller: str) -> str:
    """The global name that `name` means to the caller."""
    if type(name) is not str or not name:
        raise BadArgument(f"ERROR: parameter [{parameter}] must be a non-empty string")
    _check_length(parameter, name)
    if ":" in name or " " in name:
        raise BadArgument(f"ERROR: parameter [{parameter}] contains illegal chars")
    return names.resolve(name, caller)


def topic(name: Any, caller: str) -> str:
    """As `resolved`, for a topic."""
    return _below_root("topic", name, caller)


def service(name: Any, caller: str) -> str:
    """As `resolved`, for a service."""
    return _below_root("service", name, caller)


def _below_root(parameter: str, name: Any, caller: str) -> str:
    found = resolved(parameter, name, caller)
    if name == "/":
        raise BadArgument(f"ERROR: parameter [{parameter}] cannot be the global namespace")
    return found


def topic_type(type_name: Any) -> str:
    """`package/Type`, or `*`."""
    if type(type_name) is not str or not type_name:
        raise BadArgument("ERROR: parameter [topic_type] must be a non-empty string")
    _check_length("topic_type", type_name)
    if type_name != ANY_TYPE and type_name.count("/") != 1:
        raise BadArgument("ERROR: parameter [topic_type] is not a valid package resource name")
    return type_name


def api_uri(parameter: str, api: Any) -> str:
    """The URI of a node or a service; whether anybody is there is another question."""
    if type(api) is not str or not api:
        raise BadArgument(f"ERROR: parameter [{parameter}] is not an XMLRPC URI")
    _check_length(parameter, api)
    if not api.startswith(("http://", "rosrpc://")):
        raise BadArgument(f"ERROR: parameter [{parameter}] is not an RPC URI")
    return api


def param_key(key: Any, caller: str) -> str:
    """The global name of a parameter."""
    if not key:
        raise BadArgument("ERROR: parameter [key] must be specified and non-empty")
    if type(key) is not str:
        raise BadArgument("ERROR: parameter [key] must be a string")
    _check_length("key", key)
    return names.resolve(key, caller)


def subgraph(name: Any, caller: str) -> str:
    """What topics are to begin with: a namespace with a slash behind it."""
    if type(name) is not str:
        raise BadArgument("ERROR: parameter [subgraph] must be a string")
    _check_length("subgraph", name)
    return names.resolve(name, caller).rstrip("/") + "/" if name else "/"


def _check_length(parameter: str, text: str) -> None:
    if len(text) > NAME_LIMIT:
        raise BadArgument(f"ERROR: parameter [{parameter}] is longer than {NAME_LIMIT} characters")
