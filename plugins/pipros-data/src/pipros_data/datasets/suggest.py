"""Suggest a description of a data set from the topics of a bag."""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from pipros.basics.printable import listed
from pipros.msg.bulk.columns import ListColumn, TextColumn
from pipros.safe.settings import BadSettings
from pipros_data.bags import names_of
from pipros_data.datasets.signals import USUAL_FIELDS
from pipros_data.table import STAMP, Table

if TYPE_CHECKING:
    from pipros_data.bags import Bags

_ACTION = re.compile(r"(^|[/_])(cmd|command|commands|goal|target|setpoint|action)([/_]|$)|cmd_vel|_desired")
_RARE_HZ = 10
_CAMERAS = ("sensor_msgs/CompressedImage", "sensor_msgs/Image")


def suggest(bags: Bags, rows: int = 200) -> str:
    """Return a first version of a description, for the user to correct.

    Topics of known numeric types become actions if their names suggest commands, otherwise observations. The
    rate is the rate of the slowest camera. Without cameras, it is the rate of the slowest observation, and
    without observations, of the slowest action. Topics below 10 Hz are only considered if there are no faster
    ones. The rate is rounded and limited to the range from 1 to 50. Only the first messages of each topic are
    read.

    Raises:
        BadSettings: no topic with at least two messages has a known type.
    """
    parts: dict[str, list[str]] = {each: [] for each in ("observations", "cameras", "actions")}
    rates: dict[str, list[float]] = {each: [] for each in parts}
    taken: set[str] = set()
    left_out, episodes = [], "file  # or {topic: /episode}, with std_msgs/Bool or String"
    counts = _counts(bags)
    for topic in bags.topics():
        kind = bags.connections_of(topic)[0][1].type
        if kind in ("std_msgs/Bool", "std_msgs/String") and "episode" in topic:
            episodes = f"{{topic: {json.dumps(topic)}}}  # or file: each bag is an episode"
            continue
        is_usual = kind in (*_CAMERAS, *USUAL_FIELDS) and not topic.startswith("/rosout")
        if not is_usual or counts[topic] < 2:
            left_out.append(f"{listed(topic)} ({listed(kind)})")
            continue
        table = next(bags.batches(topic)).take(slice(rows))
        rate = _rate(table)
        group = _group(topic, kind)
        parts[group] += [f"  {_name(topic, taken)}:", *_signal(topic, kind, table, rate)]
        rates[group].append(rate)
    found = rates["cameras"] or rates["observations"] or rates["actions"]
    if not found:
        names = names_of(bags.topics())
        raise BadSettings(f"no topic has two or more messages of a known type, got {names}")
    rate = min([each for each in found if each >= _RARE_HZ] or found)
    head = [
        f"rate: {max(1, min(50, round(rate)))}  # rows per second",
        "tolerance: 0.1  # s; a row without a message this close in time is a gap",
        "gaps: skip  # episodes with gaps; or hold (the last message), or keep (null)",
        f"episodes: {episodes}",
        'task: ""  # what the robot does, in words',
    ]
    for group, lines in parts.items():
        head += [f"{group}:" if lines else f"{group}: {{}}", *lines]
    return "\n".join([*head, f"# left out: {', '.join(left_out) or 'nothing'}"]) + "\n"


def _counts(bags: Bags) -> Counter[str]:
    """Return the number of messages of each topic. `Bags.count` takes as long for one of them."""
    found: Counter[str] = Counter()
    for bag in bags.readers:
        numbers = bag.count_by_connection()
        for each in bag.connections:
            found[each.topic] += numbers.get(each.id, 0)
    return found


def _rate(table: Table) -> float:
    """Return the usual rate of a topic's messages in Hz; 1 if they have no usual distance in time."""
    steps = np.diff(table.times())
    step_ns = float(np.median(steps)) if len(steps) else 0.0
    return 1e9 / step_ns if step_ns > 0 else 1.0


def _group(topic: str, kind: str) -> str:
    if kind in _CAMERAS:
        return "cameras"
    return "actions" if _ACTION.search(topic) else "observations"


def _signal(topic: str, kind: str, table: Table, rate: float) -> list[str]:
    """Return the lines that describe a topic, without its name."""
    lines = [f"    topic: {json.dumps(topic)}  # {kind}, {rate:.3g} Hz"]
    if kind not in _CAMERAS:
        lines += [*_fields(table, kind), "    # unit: …, min: …, max: …"]
    elif kind == _CAMERAS[0]:
        lines.append("    store: video  # or jpeg, which keeps the pictures as they are")
    if STAMP not in table or not table[STAMP].any():
        lines.append("    time: receipt  # there are no stamps")
    if rate < _RARE_HZ:
        lines.append(f"    tolerance: {2 / rate:.3g}  # s; the messages are rare")
    return lines


def _name(topic: str, taken: set[str]) -> str:
    base = re.sub(r"\W+|_+", "_", topic.removesuffix("/compressed")).strip("_") or "topic"
    base = f"_{base}" if base[0].isdigit() else base
    name, number = base, 2
    while name in taken:
        name, number = f"{base}_{number}", number + 1
    taken.add(name)
    return name


def _fields(table: Table, kind: str) -> list[str]:
    lines = [f"    fields: [{', '.join(USUAL_FIELDS[kind])}]"]
    names = table.get("name")
    if isinstance(names, ListColumn) and isinstance(names.values, TextColumn) and len(names):
        lines.append(f"    names: {json.dumps(list(names[0]))}")
    return lines
