"""`rosparam` for Python code: parameter files, and parameters by name.

Facade of `pipros.cli.rosparam`; see http://wiki.ros.org/rosparam.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import rosgraph
from pipros.cli.program import NO_MASTER, CommandError, Surroundings
from pipros.cli.rosparam import change as _change
from pipros.cli.rosparam import documents as _documents
from pipros.cli.rosparam import main as _main
from pipros.cli.rosparam import rendering as _rendering
from pipros.cli.rosparam import server as _server
from pipros.errors import Unreachable

__all__ = [
    "RosParamException",
    "RosParamIOException",
    "delete_param",
    "dump_params",
    "get_param",
    "get_param_server",
    "list_params",
    "load_file",
    "load_str",
    "print_params",
    "set_param",
    "set_param_raw",
    "upload_params",
    "yamlmain",
]


class RosParamException(Exception):
    """A rosparam function failed."""


class RosParamIOException(RosParamException):
    """The parameter server does not answer."""


@contextlib.contextmanager
def _surroundings() -> Iterator[Surroundings]:
    try:
        with Surroundings("rosparam") as here:
            yield here
    except Unreachable:
        raise RosParamIOException(NO_MASTER) from None
    except CommandError as error:
        raise RosParamException(str(error)) from None


def get_param_server() -> rosgraph.Master:
    """The master, whose `getParam`, `setParam`, … are the parameter server."""
    return rosgraph.Master("/rosparam")


def get_param(param: str) -> Any:
    """The value of a parameter, or the dictionary of a namespace.

    Raises:
        RosParamException: it is not set.
    """
    with _surroundings() as here:
        return _server.read(here.master, param)


def set_param(param: str, value: str, verbose: bool = False) -> None:
    """Sets a parameter to what a YAML text means."""
    set_param_raw(param, _change.parse_value(value, param), verbose)


def set_param_raw(param: str, value: Any, verbose: bool = False) -> None:
    """Sets a parameter; the values of a dictionary are set one by one, so that their neighbours stay."""
    with _surroundings() as here:
        for leaf, part in _server.write(here.master, param, value):
            if verbose:
                print(f"set parameter [{leaf}] to [{part}]")


def upload_params(ns: str, values: Any, verbose: bool = False) -> None:
    """Sets all parameters of a dictionary in a namespace."""
    if ns == "/" and not isinstance(values, Mapping):
        raise RosParamException("global / can only be set to a dictionary")
    if verbose:
        print_params(values, ns)
    set_param_raw(ns, values)


def delete_param(param: str, verbose: bool = False) -> None:
    """Removes a parameter or a namespace.

    Raises:
        RosParamException: it is not set.
    """
    with _surroundings() as here:
        _server.delete(here.master, param)
    if verbose:
        print(f"deleted parameter [{param}]")


def list_params(ns: str) -> list[str]:
    """The names of all parameters in a namespace, sorted."""
    with _surroundings() as here:
        return _server.names_below(here.master, here.resolve(ns))


def load_file(
    filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[tuple[Any, str]]:
    """The documents of a YAML file, each with its namespace: `[(values, ns), …]`."""
    if verbose:
        print(f"reading parameters from [{filename}]")
    with _surroundings() as here:
        return _documents.read_file(filename, default_namespace or here.resolve(""))


def load_str(
    str: str,  # noqa: A002  # the name that callers know
    filename: str,
    default_namespace: str | None = None,
    verbose: bool = False,  # noqa: ARG001
) -> list[tuple[Any, str]]:
    """As `load_file`, of a text; `filename` only stands in errors."""
    with _surroundings() as here:
        return _documents.read_text(str, filename, default_namespace or here.resolve(""))


def dump_params(filename: str | None, param: str, verbose: bool = False) -> None:
    """Writes a parameter or a namespace as YAML to a file, or to standard output."""
    tree = get_param(param)
    if verbose:
        print_params(tree, param)
    text = _rendering.as_document(tree)
    if filename:
        Path(filename).write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)


def print_params(params: Any, ns: str) -> None:
    """Prints each parameter as `name=value`."""
    for name, value in _server.leaves(ns, params):
        print(f"{name}={value}")


def yamlmain(argv: Sequence[str] | None = None) -> None:
    """The command `rosparam`; ends the process. The first argument is the name of the program."""
    sys.exit(_main(None if argv is None else argv[1:]))
