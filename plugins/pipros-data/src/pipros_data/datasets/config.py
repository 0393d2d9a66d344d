"""The description of a data set: `robot.yaml`."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipros.basics.input_file import read_text
from pipros.safe.settings import BadSettings, Settings
from pipros.safe.yaml import YamlError
from pipros_data.nearest import DIRECTIONS

GAPS = ("skip", "keep", "hold")
TIMES = ("header", "receipt")
LINEAR = "linear"  # interpolates between the messages before and after a row
STORES = ("video", "jpeg")
STOPS = ("zero", "hold", "")

CHECKS = {"missing": 1.5, "clock": 0.1, "frozen": 2.0, "saturated": 0.1, "stopped": 1.0}
"""Default thresholds of the checks in `pipros_data.datasets.checks`. A threshold of 0 turns a check off."""

_SECTIONS = ["observations", "cameras", "actions", "checks"]
_KEYS = ["rate", "time", "tolerance", "gaps", "episodes", "task", "watchdog", *_SECTIONS]
_SOURCE_KEYS = ["topic", "time", "tolerance", "checks", "pick"]
_ACTION_KEYS = ["type", "stop", "teleop"]
_SIGNAL_KEYS = [*_SOURCE_KEYS, "fields", "names", "unit", "scale", "min", "max"]


@dataclass(frozen=True, slots=True)
class DatasetSource:
    """A topic of the data set."""

    name: str  # the name in the data set, such as observations.joints
    place: str  # file, line and key, for error messages
    topic: str
    time: str  # the timestamp by which messages are aligned: one of TIMES
    tolerance: float  # maximum difference between the times of a message and its row (s)
    checks: Mapping[str, float]
    pick: str  # how a row's message is chosen: one of DIRECTIONS or, for numbers, LINEAR

    @property
    def short_name(self) -> str:
        """The name without its section: `joints`."""
        return self.name.partition(".")[2]


@dataclass(frozen=True, slots=True)
class SignalSource(DatasetSource):
    """Numbers from a topic."""

    fields: tuple[str, ...]  # empty for the usual fields of the type
    names: tuple[str, ...]  # of the numbers; in messages such as JointState, they select the elements
    unit: str  # the unit in the data set; may be empty
    scale: float  # factor from the numbers in the messages to this unit
    least: tuple[float, ...]  # minimum in this unit: empty, one for all numbers, or one for each
    most: tuple[float, ...]  # maximum in this unit, in the same form as `least`
    type: str  # for actions: the message type; empty for the type registered with the master
    stop: str | tuple[float, ...]  # for actions: `zero`, `hold` or numbers; empty for the default
    teleop: str  # for actions: the topic of a teleoperator's commands; may be empty


@dataclass(frozen=True, slots=True)
class CameraSource(DatasetSource):
    """Pictures from a topic."""

    store: str  # one of STORES


@dataclass(frozen=True, slots=True)
class DatasetConfig:
    """The description of a data set."""

    rate: float  # rows per second
    gaps: str  # how to treat rows without a message within the tolerance: one of GAPS
    marker: str  # the topic that marks episodes; empty if each bag is one episode
    task: str  # the task as text; empty if it is unknown or read from `task_topic`
    task_topic: str  # the topic of the task's text; may be empty
    signals: tuple[SignalSource, ...]
    cameras: tuple[CameraSource, ...]
    watchdog: float  # time (s) after a policy's last action until the robot is stopped; 0 for no limit
    digest: str  # a hash of the file

    @property
    def actions(self) -> tuple[SignalSource, ...]:
        """The signals in the section `actions`."""
        return tuple(each for each in self.signals if each.name.startswith("actions."))

    @property
    def sources(self) -> tuple[SignalSource | CameraSource, ...]:
        """All topics of the data set."""
        return (*self.signals, *self.cameras)


def read_config(path: Path) -> DatasetConfig:
    """Read a description.

    Raises:
        BadSettings: the file cannot be read, or a value is invalid. The text names the file, line and key.
    """
    try:
        text = read_text(path)
        top = Settings.parsed(text, str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise BadSettings(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from None
    except YamlError as error:
        raise BadSettings(str(error)) from None
    top.only(_KEYS)
    shared = {
        "time": top.choice("time", TIMES, "header"),
        "tolerance": top.number("tolerance", 0.1, least=0),
        "checks": _checks(top, CHECKS),
    }
    groups = [top.section("observations"), top.section("actions")]
    signals = tuple(_signal(each, shared) for group in groups for each in group.sections())
    cameras = tuple(_camera(each, shared) for each in top.section("cameras").sections())
    if not signals and not cameras:
        raise top.error("", "observations, actions or cameras must contain a topic. Try --suggest")
    rate = top.number("rate", None, least=0.001, most=10_000)
    task, task_topic = _text_or_topic(top, "task", ["topic"])
    episodes, marker = _text_or_topic(top, "episodes", ["topic", "service"])
    if episodes not in ("", "file"):
        raise top.error("episodes", f"must be file, {{topic: …}} or {{service: …}}, got {episodes!r}")
    digest = hashlib.sha256(text.encode()).hexdigest()
    gaps, watchdog = top.choice("gaps", GAPS, "skip"), top.number("watchdog", 0.5, least=0)
    return DatasetConfig(rate, gaps, marker, task, task_topic, signals, cameras, watchdog, digest)


def _text_or_topic(top: Settings, key: str, kinds: list[str]) -> tuple[str, str]:
    if not isinstance(top.values.get(key), dict):
        return top.text(key, ""), ""
    section = top.section(key)
    section.only(kinds)
    if len(section.values) != 1:
        raise top.error(key, f"must contain exactly one key: {' or '.join(kinds)}")
    return "", section.text(next(iter(section.values)))


def _checks(section: Settings, defaults: Mapping[str, float]) -> dict[str, float]:
    found = section.section("checks")
    found.only(CHECKS)
    return {name: found.number(name, value, least=0) for name, value in defaults.items()}


def _shared(section: Settings, shared: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "name": section.key,
        "place": section.place(),
        "topic": section.text("topic"),
        "time": section.choice("time", TIMES, shared["time"]),
        "tolerance": section.number("tolerance", shared["tolerance"], least=0),
        "checks": _checks(section, shared["checks"]),
    }


def _signal(section: Settings, shared: Mapping[str, object]) -> SignalSource:
    is_action = section.key.startswith("actions.")
    section.only([*_SIGNAL_KEYS, *(_ACTION_KEYS if is_action else ())])
    if abs(section.number("scale", 1.0, least=-math.inf)) < 1e-12:  # actions are divided by it
        raise section.error("scale", "must not be 0, or closer to 0 than 1e-12")
    is_word = isinstance(section.values.get("stop", ""), str)
    return SignalSource(
        **_shared(section, shared),
        pick=section.choice("pick", (*DIRECTIONS, LINEAR), "backward"),
        fields=section.texts("fields"),
        names=section.texts("names"),
        unit=section.text("unit", ""),
        scale=section.number("scale", 1.0, least=-math.inf),
        least=section.numbers("min"),
        most=section.numbers("max"),
        type=section.text("type", ""),
        stop=section.choice("stop", STOPS, "") if is_word else section.numbers("stop"),
        teleop=section.text("teleop", ""),
    )


def _camera(section: Settings, shared: Mapping[str, object]) -> CameraSource:
    section.only([*_SOURCE_KEYS, "store"])
    pick = section.choice("pick", DIRECTIONS, "backward")
    return CameraSource(**_shared(section, shared), pick=pick, store=section.choice("store", STORES, "video"))
