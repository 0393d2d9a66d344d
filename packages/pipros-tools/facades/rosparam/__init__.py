"""Python API of `rosparam`: parameters by name, and parameter files.

Functions that use the parameter server raise `RosParamIOException` if it cannot be reached.
Facade of `pipros_tools.graph`; see http://wiki.ros.org/rosparam.
"""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from yaml.constructor import ConstructorError

import rosgraph
from pipros.basics.replaced_file import overwritten_file as _overwritten_file
from pipros.safe import yaml as _yaml
from pipros_tools.cli.rosparam import main as _main
from pipros_tools.graph import param_files as _documents
from pipros_tools.graph import param_text as _rendering
from pipros_tools.graph import params as _server
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import translated
from rosgraph.names import (
    GLOBALNS,
    get_ros_namespace,
    make_caller_id,
    make_global_ns,
    ns_join,
    script_resolve_name,
)

__all__ = [
    "GLOBALNS",
    "NAME",
    "NS",
    "RosParamException",
    "RosParamIOException",
    "construct_angle_degrees",
    "construct_angle_radians",
    "construct_yaml_binary",
    "delete_param",
    "dump_params",
    "get_param",
    "get_param_server",
    "get_ros_namespace",
    "list_params",
    "load_file",
    "load_str",
    "make_caller_id",
    "make_global_ns",
    "ns_join",
    "pattern",
    "print_params",
    "represent_foo",
    "represent_xml_binary",
    "script_resolve_name",
    "set_param",
    "set_param_raw",
    "upload_params",
    "yamlmain",
]

NAME = "rosparam"
NS = "_ns"

pattern = re.compile(r"^rad\([^\)]*\)$")
"""Pattern for strings in YAML files that represent angles in radians."""


class RosParamException(Exception):
    """A rosparam function failed."""


class RosParamIOException(RosParamException):
    """The parameter server cannot be reached."""


@contextlib.contextmanager
def _graph() -> Iterator[GraphClient]:
    with translated(RosParamIOException, RosParamException), GraphClient("rosparam") as graph:
        try:
            yield graph
        except _server.ParameterNotSet as error:
            raise rosgraph.MasterError(str(error)) from None


def get_param_server() -> rosgraph.Master:
    """Return a proxy for the master, which provides the parameter server's methods, such as `getParam`."""
    return rosgraph.Master("/rosparam")


def get_param(param: str) -> Any:
    """Return the value of a parameter, or a dictionary for a namespace.

    Raises:
        rosgraph.MasterError: the parameter is not set.
    """
    with _graph() as graph:
        return _server.read(graph.master, param)


def set_param(param: str, value: str, verbose: bool = False) -> None:
    """Set a parameter to the value that a YAML string represents."""
    set_param_raw(param, _documents.parse_value(value, param), verbose)


def set_param_raw(param: str, value: Any, verbose: bool = False) -> None:
    """Set a parameter. A dictionary is set value by value, keeping the namespace's other parameters."""
    with _graph() as graph:
        for leaf, part in _server.write(graph.master, param, value):
            if verbose:
                print(f"set parameter [{leaf}] to [{part}]")


def upload_params(ns: str, values: Any, verbose: bool = False) -> None:
    """Set all parameters in the dictionary `values`, with names relative to the namespace `ns`.

    Raises:
        RosParamException: `ns` is `/` and `values` is not a dictionary.
    """
    if ns == "/" and not isinstance(values, Mapping):
        raise RosParamException("global / can only be set to a dictionary")
    if verbose:
        print_params(values, ns)
    set_param_raw(ns, values)


def delete_param(param: str, verbose: bool = False) -> None:
    """Delete a parameter or a namespace.

    Raises:
        rosgraph.MasterError: the parameter is not set.
    """
    with _graph() as graph:
        _server.delete(graph.master, param)
    if verbose:
        print(f"deleted parameter [{param}]")


def list_params(ns: str) -> list[str]:
    """Return the names of all parameters in a namespace, sorted."""
    with _graph() as graph:
        return _server.names_below(graph.master, graph.resolve(ns))


def load_file(
    filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[tuple[Any, str]]:
    """Return the documents in a YAML file, each with its namespace: `[(values, ns), …]`."""
    if verbose:
        print(f"reading parameters from [{filename}]")
    with _graph() as graph:
        return _documents.read_file(filename, default_namespace or graph.resolve(""))


def load_str(
    str: str,  # noqa: A002  # Noetic's name
    filename: str,
    default_namespace: str | None = None,
    verbose: bool = False,  # noqa: ARG001
) -> list[tuple[Any, str]]:
    """Like `load_file`, but read from a string; `filename` is used only in error messages."""
    with _graph() as graph:
        return _documents.read_text(str, filename, default_namespace or graph.resolve(""))


def dump_params(filename: str | None, param: str, verbose: bool = False) -> None:
    """Write a parameter or a namespace as YAML to a file, or to standard output if `filename` is None."""
    tree = get_param(param)
    if verbose:
        print_params(tree, param)
    text = _rendering.as_document(tree)
    if filename:
        with _overwritten_file(Path(filename)) as file:
            file.write(text.encode())
    else:
        sys.stdout.write(text)


def print_params(params: Any, ns: str) -> None:
    """Print each parameter as `name=value`."""
    for name, value in _server.leaves(ns, params):
        print(f"{name}={value}")


def construct_angle_radians(loader: Any, node: Any) -> float:
    """Construct a number from an expression such as `rad(pi/2)`. Serves as a PyYAML constructor.

    Raises:
        RosParamException: the text is not an arithmetic expression.
    """
    return _angle(_yaml.construct_radians, "radian", loader, node)


def construct_angle_degrees(loader: Any, node: Any) -> float:
    """Construct an angle in radians from an expression such as `deg(90)`; see `construct_angle_radians`."""
    return _angle(_yaml.construct_degrees, "degree", loader, node)


def _angle(construct: Callable[[Any, Any], float], unit: str, loader: Any, node: Any) -> float:
    try:
        return construct(loader, node)
    except ConstructorError:
        raise RosParamException(f"invalid {unit} value: {loader.construct_scalar(node)}") from None


def construct_yaml_binary(loader: Any, node: Any) -> Any:
    """Construct an `xmlrpc.client.Binary` from a `!!binary` node. Serves as a PyYAML constructor."""
    from xmlrpc.client import Binary

    return Binary(loader.construct_yaml_binary(node))


def represent_xml_binary(loader: Any, data: Any) -> Any:
    """Represent an `xmlrpc.client.Binary` as `!!binary`. Serves as a PyYAML representer."""
    from base64 import encodebytes

    text = encodebytes(data.data).decode("ascii")
    return loader.represent_scalar("tag:yaml.org,2002:binary", text, style="|")


def represent_foo(loader: Any, data: Any) -> Any:
    """Represent a string as a scalar with the tag `#`. Serves as a PyYAML representer."""
    return loader.represent_scalar("#", data)


def yamlmain(argv: Sequence[str] | None = None) -> None:
    """Run the command `rosparam`. `argv` starts with the program's name.

    Raises:
        SystemExit: the command failed, or its arguments are invalid.
    """
    if code := _main(None if argv is None else argv[1:]):
        sys.exit(code)
