"""Read the conditions of a policy file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.language.spec import TIMES
from pipros.policy.field_file import BOUNDS, ORDERED, PLAIN, field_path, place_of, read_rule
from pipros.policy.model import EACH, Condition
from pipros.safe.settings import Settings

_SIDES = ("above", "below")  # bounds of conditions only
VALUES = tuple(each for each in BOUNDS if each != "unit")
_CONDITIONS = (*_SIDES, *VALUES)


def read_conditions(top: Settings) -> Iterator[Condition]:
    """Read the section `conditions`. Raise `BadSettings` for an invalid value."""
    for section in top.section("conditions").sections():
        section.only(("topic", "type", "field", "max_age_s", *BOUNDS, *_SIDES))
        name = section.key.rpartition(".")[2]
        topic = section.text("topic")
        if not (names.is_legal_topic(topic) and names.is_global(topic)) or names.canonicalize(topic) != topic:
            raise section.error("topic", f"must be a legal global name, such as /battery, got {topic!r}")
        message_class = loaded_message(section, section.text("type"))
        path: tuple[str | int, ...] = ()
        kind = "string"
        given = [key for key in _CONDITIONS if key in section.values]
        if len(given) > 1:
            raise section.error(given[1], f"must not be combined with {given[0]}")
        if "field" in section.values:
            path, kind = field_path(section, section.text("field"), message_class, "field")
            if (kind not in ORDERED and kind not in PLAIN) or EACH in path:
                text = "must name one number, string or boolean, such as buttons[4]"
                raise section.error("field", text)
            if kind in TIMES:
                raise section.error("field", "must not be a time; max_age_s limits the age of messages")
            if not given:
                bounds = f"{', '.join(_CONDITIONS[:-1])} or {_CONDITIONS[-1]}"
                raise section.error("", f"must have {bounds} for its field")
        elif given:
            raise section.error(given[0], "needs the key field")
        is_number = kind in ORDERED
        rule = read_rule(section, is_number=is_number or not path, kind=kind)
        if "above" in section.values or "below" in section.values:
            if not is_number:
                raise section.error("field", f"must be a number, got the type {kind}")
            least, most = (
                section.number(key, end, least=-math.inf) * rule.unit.factor if key in section.values else end
                for key, end in (("above", -math.inf), ("below", math.inf))
            )
            rule = replace(rule, least=least, most=most)
        age_s = section.number("max_age_s", None, least=0.01)
        yield Condition(place_of(section), name, topic, message_class, path, rule, age_s)


def loaded_message(section: Settings, type_name: str) -> Any:
    """Return the class of a message type. Raise `BadSettings` if the type is unknown."""
    try:
        return load_message_class(type_name)
    except PiprosError as error:
        raise section.error("type", str(error)) from None
