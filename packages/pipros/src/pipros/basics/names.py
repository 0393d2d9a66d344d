"""Graph resource names: validation, resolution and remapping arguments.

Implements the rules of http://wiki.ros.org/Names as genuine ROS applies them. All functions except
`anonymous`, which uses the process id and the time, are pure.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from pipros.basics.errors import InvalidName

NAME_CHARACTERS = 16 * 1024
"""Limit: a name or a URI in a call to the master. Beyond it, the call is refused; the response names the
limit.
"""

REPLACED = "new node registered with same name"
"""The reason that a master gives when it shuts down the older of two nodes with the same name."""

# Not compiled on import: `re` compiles and caches patterns on first use, and many tools use none of them.
_LEGAL = r"[~/A-Za-z][A-Za-z0-9_/]*"
_LEGAL_KEY = r"[~/A-Za-z_][A-Za-z0-9_/]*"
_LEGAL_BASE = r"[A-Za-z][A-Za-z0-9_]*"
_ILLEGAL_IN_ANONYMOUS = r"[.\-:]"


def is_legal(name: str) -> bool:
    """Return True for a legal graph name: `a`, `/a/b`, `~a`, and the empty name."""
    return not name or (re.fullmatch(_LEGAL, name) is not None and "//" not in name)


def is_legal_topic(name: str) -> bool:
    """Return True if `name` is a valid topic name in a bag, such as `a` or `/a/b`.

    Private names and `/` are not valid.

    >>> is_legal_topic("/a/b"), is_legal_topic("/"), is_legal_topic("/../a")
    (True, False, False)
    """
    return is_legal(name) and not is_private(name) and bool(name.strip("/"))


def is_legal_base(name: str) -> bool:
    """Return True for a legal name without a namespace, such as the base name of a node: `talker`."""
    return re.fullmatch(_LEGAL_BASE, name) is not None


def is_global(name: str) -> bool:
    return name.startswith("/")


def is_private(name: str) -> bool:
    return name.startswith("~")


class NotText(InvalidName, TypeError):
    """A name is not a string."""


def text_of(name: object) -> str:
    """Return a name unchanged.

    Raises:
        NotText: it is not a string. Programs often pass None, the result of a search without success.
    """
    if not isinstance(name, str):
        raise NotText(f"a name must be a string, got {name!r}")
    return name


def canonicalize(name: str) -> str:
    """Return the name without doubled and trailing slashes.

    >>> canonicalize("//a//b/")
    '/a/b'
    """
    if not name or name == "/":
        return name
    parts = [part for part in name.split("/") if part]
    return ("/" if name[0] == "/" else "") + "/".join(parts)


def namespace(name: str) -> str:
    """Return the namespace of a name, with a trailing slash.

    >>> namespace("/a/b/")
    '/a/'
    """
    return name.rstrip("/").rpartition("/")[0] + "/"


def as_namespace(name: str) -> str:
    """Return the name with a trailing slash: the prefix of every name below it.

    >>> as_namespace("/a/b"), as_namespace("/")
    ('/a/b/', '/')
    """
    return name if name.endswith("/") else name + "/"


def join(ns: str, name: str) -> str:
    """Return `name` in the namespace `ns`. A global or private name is returned unchanged.

    >>> join("/robot", "battery"), join("/robot/", "/battery"), join("~", "rate")
    ('/robot/battery', '/battery', '~rate')
    """
    if not ns or is_global(name) or is_private(name):
        return name
    if ns == "~" or ns.endswith("/"):
        return ns + name
    return f"{ns}/{name}"


def make_global_namespace(ns: str) -> str:
    """Return the namespace with a leading and a trailing slash.

    Raises:
        InvalidName: the name is private, and so cannot be a namespace.
    """
    if is_private(ns):
        raise InvalidName(f"cannot turn [{ns}] into a global name")
    if not is_global(ns):
        ns = "/" + ns
    return as_namespace(ns)


def resolve(name: str, node_name: str, remappings: Mapping[str, str] | None = None) -> str:
    """Resolve `name` to a global name, as in the node `node_name`, and apply remappings.

    `node_name` is the node's full name (`/ns/node`). The keys and values of `remappings` must be
    global names (see `resolve_remappings`).

    >>> resolve("~rate", "/ns/talker"), resolve("rate", "/ns/talker"), resolve("", "/ns/talker")
    ('/ns/talker/rate', '/ns/rate', '/ns/')
    """
    if not text_of(name):
        return namespace(node_name)
    name = canonicalize(name)
    if is_global(name):
        resolved = name
    elif is_private(name):
        resolved = canonicalize(f"{node_name}/{name[1:]}")
    else:
        resolved = namespace(node_name) + name
    return remappings.get(resolved, resolved) if remappings else resolved


class InvalidKey(ValueError):
    """A dictionary of parameters has a key that is not a string.

    Attributes:
        within: the dictionary.
    """

    def __init__(self, name: str, key: object, within: Mapping[Any, Any]) -> None:
        self.within = within
        super().__init__(f"a key must be a string, got {key!r} below [{name}]; put it in quotes")


def leaves_below(
    name: str, value: Any, combine: Callable[[str, str], str] = join
) -> Iterator[tuple[str, Any]]:
    """Yield the name and value of each parameter in `value`, which is stored at `name`.

    Dictionaries are namespaces; empty dictionaries are omitted.

    Args:
        combine: joins a namespace and a key.

    Raises:
        InvalidKey: a key is not a string.

    >>> list(leaves_below("/wheels", {"left": 1, "rear": {"left": 2}}))
    [('/wheels/left', 1), ('/wheels/rear/left', 2)]
    """
    if not isinstance(value, Mapping):
        yield name, value
        return
    for key, part in value.items():
        if not isinstance(key, str):
            raise InvalidKey(name, key, value)
        yield from leaves_below(combine(name, key), part, combine)


def valid_topics(parameter: str, given: object, complain: Callable[[str], object]) -> list[str]:
    """Return the topic names in a parameter, which must be a list, and complain about all other entries."""
    if not isinstance(given, list):
        complain(f"{parameter} must be a list of topics, got {given!r:.200}; it is ignored")
        return []
    found = []
    for each in given:
        if isinstance(each, str) and each.strip("/~") and is_legal(canonicalize(each)):
            found.append(each)
        else:
            complain(f"{parameter}: {each!r:.200} is not a topic name; it is left out")
    return found


def anonymous(base: str) -> str:
    """Return a unique name in rospy's format: `base_<process id>_<milliseconds>`."""
    return re.sub(_ILLEGAL_IN_ANONYMOUS, "_", f"{base}_{os.getpid()}_{int(time.time() * 1000)}")


_NOTHING: Mapping[str, str] = MappingProxyType({})


class Arguments(NamedTuple):
    """A command line's arguments, classified by the ROS rules.

    Attributes:
        remappings: arguments of the form `from:=to`, with both sides as written.
        params: values from `_name:=value`, as YAML text, keyed by name without the underscore.
        special: values from `__name:=value`. The keys include the underscores: `__name`, `__ns`, `__log`,
            `__ip`, `__hostname`, `__master`, ….
        rest: all other arguments in order.
        malformed: arguments with a key and more than one `:=`; they have no effect.
    """

    remappings: Mapping[str, str] = _NOTHING
    params: Mapping[str, str] = _NOTHING
    special: Mapping[str, str] = _NOTHING
    rest: Sequence[str] = ()
    malformed: Sequence[str] = ()


def is_remapping_argument(argument: str) -> bool:
    """Return True for `key:=...`, even if the value is empty; `:=` and `:=b` have no key."""
    return ":=" in argument and not argument.startswith(":=")


def is_legal_remapping(argument: str) -> bool:
    """Return True if `argument` is a remapping, `key:=...`, whose key is a legal name or begins with `_`.

    Such arguments are removed from the program's arguments.

    >>> [is_legal_remapping(argument) for argument in ("a:=b", "_rate:=5", "-a:=b", "a b:=c", ":=b")]
    [True, True, False, False, False]
    """
    key, sign, _ = argument.partition(":=")
    return bool(sign) and re.fullmatch(_LEGAL_KEY, key) is not None


def without_launch_arguments(argv: Iterable[str]) -> list[str]:
    """Return the arguments without those that roslaunch appends for a `<node>`.

    They are remappings, then `__name:=` and `__log:=`. Other remappings may be values.

    >>> without_launch_arguments(["kill", "-a", "x:=y", "__name:=killer", "__log:=/tmp/killer.log"])
    ['kill', '-a']
    >>> without_launch_arguments(["set", "pair", "a:=b"])
    ['set', 'pair', 'a:=b']
    """
    words = list(argv)
    if any(word.startswith("__name:=") for word in words):
        while words and is_legal_remapping(words[-1]):
            words.pop()
    return words


def parse_arguments(argv: Iterable[str]) -> Arguments:
    """Classify a command line as described in http://wiki.ros.org/Remapping%20Arguments.

    >>> parsed = parse_arguments(["prog", "a:=b", "_rate:=3", "__name:=t", "file"])
    >>> parsed.remappings, parsed.params, parsed.special, parsed.rest
    ({'a': 'b'}, {'rate': '3'}, {'__name': 't'}, ('prog', 'file'))
    """
    remappings: dict[str, str] = {}
    params: dict[str, str] = {}
    special: dict[str, str] = {}
    rest: list[str] = []
    malformed: list[str] = []
    for argument in argv:
        if not is_remapping_argument(argument):
            rest.append(argument)
            continue
        key, value, *more = (part.strip() for part in argument.split(":="))
        if more:
            malformed.append(argument)
        elif not key or not value:
            continue
        elif key.startswith("__"):
            special[key] = value
        elif key.startswith("_") and len(key) > 1:
            params[key[1:]] = value
        else:
            remappings[key] = value
    return Arguments(remappings, params, special, tuple(rest), tuple(malformed))


def resolve_remappings(remappings: Mapping[str, str], node_name: str) -> dict[str, str]:
    """Return the remappings with both sides resolved to global names for the node `node_name`."""
    return {resolve(key, node_name): resolve(value, node_name) for key, value in remappings.items()}
