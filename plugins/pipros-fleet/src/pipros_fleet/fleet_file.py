"""A member's YAML file: what the member shares and accepts, and how it sends messages.

    router: tls/fleet.example.org:7447
    show: ["robot*"]                 # members whose topics and services appear here; default: all
    bandwidth_kbit: 1000             # limit for messages to other members; default: unlimited
    share:
      topics:
        - name: /camera/**
          rate_hz: 2
          latest_only: true
          priority: low
          compress: true
        - name: /tf
          rate_hz: 10
          prefix_frames: true
        - name: /debug/**
          allow: false
        - /**
      parameters: [/robot_description]
    accept:
      topics:
        - name: /cmd_vel
          from: [operator]
      services: [/reset]
      parameters: []

The first rule with a matching name applies; a name without a matching rule is neither shared nor accepted.
`*` matches any characters except slashes, and `**` matches any characters. Without a file, a member shares
all topics and accepts nothing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_file
from pipros.basics.printable import printable
from pipros.safe import yaml
from pipros_fleet.fleet_rules import ANYONE, SHARE_ALL, FleetFile, FleetRule, Priority

FLEET_FILE_BYTES = 256 * 1024
"""Maximum size of a member's YAML file. Beyond it, the file is refused before it is parsed."""


class BadFleetFile(PiprosError, ValueError):
    """A fleet file cannot be read or has an invalid value."""


_TOPIC_KEYS: Final = frozenset({"rate_hz", "latest_only", "priority", "compress", "prefix_frames"})
_LISTS: Final[Mapping[str, Mapping[str, frozenset[str]]]] = {
    "share": {"topics": _TOPIC_KEYS, "parameters": frozenset({"from"})},
    "accept": {
        "topics": frozenset({"from"}),
        "services": frozenset({"from", "timeout_s"}),
        "parameters": frozenset({"from"}),
    },
}


def read_fleet_file(path: str | Path) -> FleetFile:
    """Read and parse a fleet file.

    Raises:
        BadFleetFile: the file cannot be read, is larger than `FLEET_FILE_BYTES`, or is invalid.
    """
    try:
        return parse_fleet_file(read_file(path, FLEET_FILE_BYTES), str(path))
    except OSError as error:
        raise BadFleetFile(f"cannot read {path}: {error.strerror or error}") from None


def parse_fleet_file(content: str | bytes, file: str = "<string>") -> FleetFile:
    """Parse a fleet file; see the module's docstring. Error messages name it `file`.

    Raises:
        BadFleetFile: the text is not YAML, or has an unknown key or an invalid value.
    """
    try:
        values = yaml.load(content, file, angles=False)
    except yaml.YamlError as error:
        raise BadFleetFile(str(error)) from None
    reader = _FleetReader(file)
    top = reader.mapping({} if values is None else values, "", {"router", "show", "bandwidth_kbit", *_LISTS})
    rules: dict[tuple[str, str], Sequence[FleetRule]] = {}
    for part, lists in _LISTS.items():
        section = reader.mapping(top.get(part, {}), part, lists.keys())
        for kind, keys in lists.items():
            if kind in section:
                rules[part, kind] = reader.rules(section[kind], f"{part}.{kind}", keys)
    return FleetFile(
        reader.text(top.get("router", ""), "router"),
        reader.texts(top.get("show", list(ANYONE)), "show"),
        reader.number(top.get("bandwidth_kbit", 0), "bandwidth_kbit"),
        rules.get(("share", "topics"), SHARE_ALL),
        rules.get(("share", "parameters"), ()),
        rules.get(("accept", "topics"), ()),
        rules.get(("accept", "services"), ()),
        rules.get(("accept", "parameters"), ()),
    )


@dataclass(frozen=True, slots=True)
class _FleetReader:
    """Converts YAML values. Error messages contain the names of the file and the key."""

    file: str
    _keys: Mapping[str, tuple[str, Callable[[Any, str], Any]]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        keys = {
            "allow": ("is_allowed", self.flag),
            "from": ("members", self.texts),
            "rate_hz": ("rate_hz", self.number),
            "latest_only": ("is_latest_only", self.flag),
            "priority": ("priority", self.priority),
            "compress": ("is_compressed", self.flag),
            "prefix_frames": ("has_prefixed_frames", self.flag),
            "timeout_s": ("timeout_s", self.duration),
        }
        object.__setattr__(self, "_keys", keys)

    def mapping(self, value: object, place: str, known: object) -> Mapping[str, Any]:
        names = sorted(known)  # type: ignore[call-overload]
        if not isinstance(value, dict):
            raise self._error(
                place or "the file", f"must be a mapping with the keys {', '.join(names)}", value
            )
        for key in value:
            if key not in names:
                what = f"{place}: " if place else ""
                raise BadFleetFile(
                    f"{self.file}: {what}unknown key [{printable(key, 100)}]; the keys are {', '.join(names)}"
                )
        return value

    def rules(self, value: object, place: str, keys: frozenset[str]) -> Sequence[FleetRule]:
        if not isinstance(value, list):
            raise self._error(place, "must be a list", value)
        return tuple(self._rule(each, f"{place}[{number}]", keys) for number, each in enumerate(value))

    def _rule(self, value: object, place: str, keys: frozenset[str]) -> FleetRule:
        if isinstance(value, str):
            return FleetRule(self._name(value, place))
        found = self.mapping(value, place, {"name", "allow", *keys})
        if "name" not in found:
            raise BadFleetFile(f"{self.file}: {place}: missing required key [name]")
        settings = {}
        for key, each in found.items():
            if key != "name":
                attribute, convert = self._keys[key]
                settings[attribute] = convert(each, f"{place}.{key}")
        return FleetRule(self._name(found["name"], f"{place}.name"), **settings)

    def _name(self, value: object, place: str) -> str:
        if not isinstance(value, str) or not re.fullmatch(r"/[\w/*]*", value, re.ASCII) or "//" in value:
            raise self._error(place, "must be a global name such as /camera/**", value)
        return value

    def flag(self, value: object, place: str) -> bool:
        if not isinstance(value, bool):
            raise self._error(place, "must be true or false", value)
        return value

    def number(self, value: object, place: str) -> float:
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not 0 <= value < math.inf:
            raise self._error(place, "must be a finite number >= 0", value)
        return float(value)

    def duration(self, value: object, place: str) -> float:
        if not self.number(value, place):
            raise self._error(place, "must be > 0", value)
        return self.number(value, place)

    def text(self, value: object, place: str) -> str:
        if not isinstance(value, str):
            raise self._error(place, "must be a string", value)
        return value

    def texts(self, value: object, place: str) -> Sequence[str]:
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            raise self._error(place, "must be a list of strings", value)
        return tuple(value)

    def priority(self, value: object, place: str) -> Priority:
        try:
            return Priority(value)
        except ValueError:
            names = ", ".join(each.value for each in Priority)
            raise self._error(place, f"must be one of {names}", value) from None

    def _error(self, place: str, rule: str, value: object) -> BadFleetFile:
        return BadFleetFile(f"{self.file}: {place} {rule}, got {printable(repr(value), 100)}")
