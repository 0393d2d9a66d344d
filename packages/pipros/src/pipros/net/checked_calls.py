"""XML-RPC API methods that check their arguments before they run."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Sequence
from typing import Any

from pipros.net.argument_checks import Check, ParameterInvalid, publishers

Method = Callable[..., Any]

_log = logging.getLogger("xmlrpc")

PUBLISHERS = "is_publishers_list"


def apivalidate(
    error_return_value: Any, validators: Sequence[Check | tuple[str, str] | None] = ()
) -> Callable[[Method], Method]:
    """Return a decorator that makes a method check its parameters.

    The method returns code -1 if a parameter is invalid or if its result is None, and code 0 if it raises an
    exception.

    Args:
        error_return_value: the value in a response with code -1 or 0.
        validators: a check for each parameter after `caller_id`. None accepts any value; the pair
            `(PUBLISHERS, name)` accepts a list of URIs, as `publishers(name)` does.
    """

    def check_validates(method: Method) -> Method:
        arity = len(validators) + 2
        if method.__code__.co_argcount != arity:
            raise AssertionError(f"{method} failed arg check")  # the exception that ROS callers catch

        @functools.wraps(method)
        def answer(*args: Any, **kwds: Any) -> Any:
            if problem := _problem(args, arity):
                return -1, problem, error_return_value
            try:
                values = [_checked(*pair, args[1]) for pair in zip(validators, args[2:], strict=True)]
                result = method(args[0], args[1], *values, **kwds)
            except ParameterInvalid as error:
                return -1, str(error) or "error", error_return_value
            except Exception as error:
                _log.exception("%s failed", method.__name__)
                return 0, f"Internal failure: {error}", error_return_value
            return (
                (-1, "Internal error (None value returned)", error_return_value) if result is None else result
            )

        return answer

    return check_validates


def _problem(args: Sequence[Any], arity: int) -> str:
    if len(args) == 1:
        return "missing required caller_id parameter"
    if len(args) != arity:
        return "Error: bad call arity"
    return "" if isinstance(args[1], str) else "caller_id must be a string"


def _checked(check: Check | tuple[str, str] | None, value: Any, caller_id: str) -> Any:
    if isinstance(check, tuple):
        check = publishers(check[1])
    return check(value, caller_id) if check else value
