"""Turns the text of a `<param>` into a value, by the rules of http://wiki.ros.org/roslaunch/XML/param."""

from __future__ import annotations

from typing import Any


def convert(text: str, type_name: str, source: str = "<param>") -> Any:
    """The value that `text` means under a type: int, double, bool, str, yaml, or auto (also when empty).

    Automatic conversion takes a float only with a dot in it, then a whole number, then true and false,
    and leaves all else as text: `1e3` and `0x10` stay texts.

    Raises:
        ValueError: when the text is none of that type, or there is no such type.

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
        from pipros.safe import yaml  # costs 10 ms, and few launch files need it

        return yaml.load(text, source, angles=False)
    raise ValueError(f"Unknown type '{type_name}'")


def convert_bool(text: str) -> bool:
    """True for `true` and `1`, False for `false` and `0`, in any case of letters.

    Raises:
        ValueError: for anything else.
    """
    word = text.lower().strip()
    if word in ("true", "1"):
        return True
    if word in ("false", "0"):
        return False
    raise ValueError(f"{text} is not a 'bool' type")


def _automatic(text: str) -> Any:
    # Python takes 1_000 for a number, ROS never did.
    if "_" not in text:
        try:
            return float(text) if "." in text else int(text)
        except ValueError:
            pass
    word = text.lower()
    if word in ("true", "false"):
        return word == "true"
    return text


def flatten(key: str, value: Any) -> dict[str, Any]:
    """A tree of parameters as full names and leaves; empty dictionaries leave nothing.

    Raises:
        ValueError: for a key that is no text, which no parameter server can hold.

    >>> flatten("/a", {"b": 1, "c": {"d": [2]}})
    {'/a/b': 1, '/a/c/d': [2]}
    """
    if not isinstance(value, dict):
        return {key: value}
    leaves: dict[str, Any] = {}
    for name, part in value.items():
        if not isinstance(name, str):
            raise ValueError(f"the key {name!r} below [{key}] is no text; put it in quotes")
        leaves.update(flatten(f"{key.rstrip('/')}/{name.strip('/')}", part))
    return leaves
