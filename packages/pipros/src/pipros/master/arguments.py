"""Check, limit and resolve the arguments of all Master API methods.

The checks and error texts are those of `pipros.net.argument_checks`.
"""

from __future__ import annotations

import logging
import reprlib
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from pipros.basics import names
from pipros.master.registry import RegistryFull
from pipros.net.argument_checks import (
    ParameterInvalid,
    api_uri,
    below_root,
    empty_or_valid_name,
    non_empty_text,
    resolved_name,
    type_name,
)

Answer = list[Any]

SUCCESS: Final = 1
INTERNAL: Final = 0
CALLER_ERROR: Final = -1

_log = logging.getLogger("rosmaster.master")


_TOPIC = below_root("topic")
_SERVICE = below_root("service")
_TOPIC_TYPE = type_name("topic_type")
_KEY = non_empty_text("key")
_SUBGRAPH = empty_or_valid_name("subgraph")


class CallArguments(NamedTuple):
    """One master's argument checks.

    Long names and URIs are refused, because parsing them would delay other callers.
    """

    name_characters: int

    def guarded(self, name: str, method: Callable[..., Answer], error_value: object) -> Callable[..., Answer]:
        """Wrap `method`: check the caller_id and the number of arguments, and convert errors to responses.

        Calls with invalid arguments are logged. At level DEBUG, all calls are logged.
        """
        name_characters = self.name_characters
        arity = method.__code__.co_argcount - 1  # the number of parameters, without `self`

        def answer(*params: object) -> Answer:
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
            except (ParameterInvalid, RegistryFull) as error:
                _log.info("%s: invalid parameter: %s", name, error)
                return [CALLER_ERROR, str(error), error_value]

        def logged_answer(*params: object) -> Answer:
            result = answer(*params)
            if _log.isEnabledFor(logging.DEBUG):
                _log.debug("%s%s returns %s", name, reprlib.repr(params), reprlib.repr(result))
            return result

        return logged_answer

    def resolved(self, parameter: str, name: object, caller: str) -> str:
        """Check `name` and resolve it to a global name, relative to the node `caller`."""
        return resolved_name(parameter, self._bounded(parameter, name), caller)

    def topic(self, name: object, caller: str) -> str:
        """Check and resolve a topic name."""
        return str(_TOPIC(self._bounded("topic", name), caller))

    def service(self, name: object, caller: str) -> str:
        """Check and resolve a service name."""
        return str(_SERVICE(self._bounded("service", name), caller))

    def topic_type(self, name: object) -> str:
        """Check a topic type, `package/Type` or `*`, and return it."""
        return str(_TOPIC_TYPE(self._bounded("topic_type", name), ""))

    def api_uri(self, parameter: str, api: object) -> str:
        """Check the form of a node's or service's URI, and return the URI. No connection is made."""
        return str(api_uri(parameter)(self._bounded(parameter, api), ""))

    def param_key(self, key: object, caller: str) -> str:
        """Check and resolve a parameter key."""
        return names.resolve(_KEY(self._bounded("key", key), caller), caller)

    def subgraph(self, name: object, caller: str) -> str:
        """Check and resolve the namespace of the requested topics, and return it with a trailing slash."""
        return names.as_namespace(_SUBGRAPH(self._bounded("subgraph", name), caller))

    def _bounded(self, parameter: str, value: object) -> Any:
        if isinstance(value, str) and len(value) > self.name_characters:
            raise ParameterInvalid(
                f"ERROR: parameter [{parameter}] is longer than {self.name_characters} characters"
            )
        return value
