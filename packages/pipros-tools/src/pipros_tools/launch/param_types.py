"""Convert the string in a `<param>` to a value, by the rules of http://wiki.ros.org/roslaunch/XML/param."""

from __future__ import annotations

from typing import Any

from pipros.basics.names import is_global, is_private, leaves_below


def convert(text: str, type_name: str, source: str = "<param>") -> Any:
    """Convert `text` to a value of a type: int, double, bool, str, yaml or auto. An empty type means auto.

    `auto` tries a float (only if the text contains a dot), then an integer, then true and false; anything
    else, including `1e3` and `0x10`, stays a string.

    Raises:
        ValueError: the text is not valid for the type, or the type is unknown.

    >>> convert("010", "auto"), convert("1e3", "auto"), convert("1.", ""), convert("True", "auto")
    (10, '1e3', 1.0, True)
    """
    type_name = type_name.lower()
    if type_name in ("", "auto"):
        return _automatic(text)
    if type_name in ("str", "string"):
        return text
    if type_name == "int":
        return int(text)
    if type_name == "double":
        return float(text)
    if type_name in ("bool", "boolean"):
        return convert_bool(text)
    if type_name == "yaml":
        # imported here, because the import takes 10 ms and few launch files need it
        from pipros.safe import yaml

        return yaml.load(text, source, angles=False)
    raise ValueError(f"Unknown type '{type_name}'")


def convert_bool(text: str) -> bool:
    """Return True for `true` and `1`, and False for `false` and `0`, ignoring case.

    Raises:
        ValueError: the text is anything else.
    """
    word = text.lower().strip()
    if word in ("true", "1"):
        return True
    if word in ("false", "0"):
        return False
    raise ValueError(f"{text} is not a 'bool' type")


def _automatic(text: str) -> Any:
    try:
        if "." in text:
            return float(text)
        if "_" not in text:  # Python accepts 1_000 as an integer; ROS does not
            return int(text)
    except ValueError:
        pass
    word = text.lower()
    if word in ("true", "false"):
        return word == "true"
    return text


def flatten(key: str, value: Any) -> dict[str, Any]:
    """Flatten a tree of parameters to names and values; empty dictionaries are dropped.

    As in Noetic, a key that is a global name is the name of that parameter, wherever the tree is stored. So
    is a private name, `~x`.

    Raises:
        InvalidKey: a key is not a string; XML-RPC allows only strings as keys.

    >>> flatten("/a", {"b": 1, "c": {"d": [2], "/e": 3}})
    {'/a/b': 1, '/a/c/d': [2], '/e': 3}
    """
    return dict(leaves_below(key, value, _below))


def _below(namespace: str, key: str) -> str:
    if is_global(key) or is_private(key):
        return key.rstrip("/")
    return f"{namespace.rstrip('/')}/{key.rstrip('/')}" if namespace else key.rstrip("/")


def parameters_in(text: str, source: str, key: str, *, is_named: bool) -> dict[str, Any]:
    """Return the parameters that a `<rosparam>`'s YAML text sets, by full name.

    Args:
        source: the file, for error messages.
        key: the parameter or namespace that the text is loaded into.
        is_named: whether `key` is the name of a parameter, whose value need not be a dictionary.

    Raises:
        YamlError: the text is invalid.
        ValueError: the value is not a dictionary although `is_named` is False, or a key is not a string.
    """
    from pipros.safe import yaml  # imported here, because the import takes 10 ms and few launch files need it

    value = yaml.load(text, source)
    if value is None:
        return {}
    if not isinstance(value, dict) and not is_named:
        raise ValueError("'param' attribute must be set for non-dictionary values")
    return flatten(key, value)
