"""Checks of the arguments of all Master API methods, with the error texts of genuine rosmaster."""

from __future__ import annotations

import logging
import reprlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from pipros import names
from pipros.master.registry import ANY_TYPE, RegistryFull

Answer = list[Any]

SUCCESS: Final = 1
INTERNAL: Final = 0
CALLER_ERROR: Final = -1

_log = logging.getLogger("rosmaster.master")


class BadArgument(Exception):
    """An argument is invalid; the text is sent back to the caller."""


@dataclass(frozen=True, slots=True)
class Arguments:
    """The checks. Longer names and URIs are refused: parsing megabytes would delay other callers."""

    name_characters: int

    def guarded(self, name: str, method: Callable[..., Answer], error_value: Any) -> Callable[..., Answer]:
        """`method` with checks of caller_id and number of arguments, and with errors turned into answers.

        Calls with bad arguments are logged, at level DEBUG all calls.
        """
        name_characters = self.name_characters
        arity = method.__code__.co_argcount - 1  # without self

        def answer(*params: Any) -> Answer:
            if not params:
                return [CALLER_ERROR, "missing required caller_id parameter", error_value]
            if type(params[0]) is not str:
                return [CALLER_ERROR, "caller_id must be a string", error_value]
            if len(params[0]) > name_characters:
                return [CALLER_ERROR, f"caller_id is longer than {name_characters} characters", error_value]
            if len(params) != arity:
                return [CALLER_ERROR, "Error: bad call arity", error_value]
            try:
                return method(*params)
            except (BadArgument, RegistryFull) as error:
                _log.info("%s: invalid parameter: %s", name, error)
                return [CALLER_ERROR, str(error), error_value]

        def logged_answer(*params: Any) -> Answer:
            result = answer(*params)
            if _log.isEnabledFor(logging.DEBUG):
                _log.debug("%s%s returns %s", name, reprlib.repr(params), reprlib.repr(result))
            return result

        return logged_answer

    def resolved(self, parameter: str, name: Any, caller: str) -> str:
        """The global name that `name` resolves to for the caller."""
        if type(name) is not str or not name:
            raise BadArgument(f"ERROR: parameter [{parameter}] must be a non-empty string")
        self._check_length(parameter, name)
        if ":" in name or " " in name:
            raise BadArgument(f"ERROR: parameter [{parameter}] contains illegal chars")
        return names.resolve(name, caller)

    def topic(self, name: Any, caller: str) -> str:
        """As `resolved`, for a topic."""
        return self._below_root("topic", name, caller)

    def service(self, name: Any, caller: str) -> str:
        """As `resolved`, for a service."""
        return self._below_root("service", name, caller)

    def _below_root(self, parameter: str, name: Any, caller: str) -> str:
        found = self.resolved(parameter, name, caller)
        if name == "/":
            raise BadArgument(f"ERROR: parameter [{parameter}] cannot be the global namespace")
        return found

    def topic_type(self, type_name: Any) -> str:
        """`package/Type`, or `*`."""
        if type(type_name) is not str or not type_name:
            raise BadArgument("ERROR: parameter [topic_type] must be a non-empty string")
        self._check_length("topic_type", type_name)
        if type_name != ANY_TYPE and type_name.count("/") != 1:
            raise BadArgument("ERROR: parameter [topic_type] is not a valid package resource name")
        return type_name

    def api_uri(self, parameter: str, api: Any) -> str:
        """The URI of a node or a service. It is not checked whether anything answers there."""
        if type(api) is not str or not api:
            raise BadArgument(f"ERROR: parameter [{parameter}] is not an XMLRPC URI")
        self._check_length(parameter, api)
        if not api.startswith(("http://", "rosrpc://")):
            raise BadArgument(f"ERROR: parameter [{parameter}] is not an RPC URI")
        return api

    def param_key(self, key: Any, caller: str) -> str:
        """The global name of a parameter."""
        if not key:
            raise BadArgument("ERROR: parameter [key] must be specified and non-empty")
        if type(key) is not str:
            raise BadArgument("ERROR: parameter [key] must be a string")
        self._check_length("key", key)
        return names.resolve(key, caller)

    def subgraph(self, name: Any, caller: str) -> str:
        """The prefix of the wanted topics: a namespace with a trailing slash."""
        if type(name) is not str:
            raise BadArgument("ERROR: parameter [subgraph] must be a string")
        self._check_length("subgraph", name)
        return names.resolve(name, caller).rstrip("/") + "/" if name else "/"

    def _check_length(self, parameter: str, text: str) -> None:
        if len(text) > self.name_characters:
            raise BadArgument(
                f"ERROR: parameter [{parameter}] is longer than {self.name_characters} characters"
            )
