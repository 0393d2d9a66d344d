"""Recorded answers of genuine nodes, in place of the nodes: see README.md in `tests.golden.recordings`.

Only pipros runs. A test gives its inputs to the recording, which compares them with the recorded ones, and
asks it for what the genuine node answered to them.
"""

import base64
import gzip
import hashlib
import io
import json
import math
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.time import Duration, Time
from tests.support.environments import REPOSITORY

FOLDER = REPOSITORY / "plugins" / "pipros-robot" / "tests" / "golden" / "recordings"
_TOLERANCES = {"rtol": 1e-6, "atol": 1e-9}
"""Sines and simulations differ in the last digits between processors, and between versions of numpy."""
_WALL_CLOCK_S = 1_000_000_000
"""Times from here on are those of the wall clock, which are recorded as 0."""


def file_of(test_id: str) -> Path:
    """Return the file of a test. It does not depend on the folder of the test."""
    module, _, name = test_id.partition("::")
    readable = re.sub(r"[^A-Za-z0-9_.-]+", "_", name)[:80]
    digest = hashlib.sha256(name.encode()).hexdigest()[:6]
    return FOLDER / Path(module).stem / f"{readable}.{digest}.json.gz"


def load(file: Path) -> Any:
    """Read a file. Arrays become those of numpy."""

    def array(found: dict[str, Any]) -> Any:
        if found.keys() != {"array", "shape", "base64"}:
            return found
        return np.frombuffer(base64.b64decode(found["base64"]), found["array"]).reshape(found["shape"])

    return json.loads(gzip.decompress(file.read_bytes()), object_hook=array)


def message_of(message_class: Any, values: Mapping[str, Any]) -> Any:
    """Return the message with recorded values, whose fields have the types of a received message."""
    buffer = io.BytesIO()
    _filled(message_class, values).serialize(buffer)
    return message_class().deserialize(buffer.getvalue())


def _filled(message_class: Any, values: Mapping[str, Any]) -> Any:
    made = message_class()
    for name, kind in zip(made.__slots__, made._slot_types, strict=True):
        if name in values:
            setattr(made, name, _field(kind, values[name]))
    return made


def _field(kind: str, value: Any) -> Any:
    base, bracket, _ = kind.partition("[")
    if bracket and base in ("uint8", "char"):
        return bytes(value)
    if bracket:
        return value.tolist() if isinstance(value, np.ndarray) else [_field(base, each) for each in value]
    if base in ("time", "duration"):
        return (Time if base == "time" else Duration)(*value)
    return _filled(load_message_class(base), value) if "/" in base else value


def first_difference(recorded: Any, given: Any, place: str = "") -> str:
    """Return the first place in which plain values differ, with both values; empty if there is none."""
    if isinstance(recorded, dict) and isinstance(given, dict):
        if recorded.keys() != given.keys():
            return f"{place}: only one of them has {sorted(recorded.keys() ^ given.keys())}"
        pairs = [(recorded[key], given[key], f"{place}.{key}") for key in recorded]
    elif isinstance(recorded, list | np.ndarray) and isinstance(given, list | tuple | np.ndarray):
        if len(recorded) != len(given):
            return f"{place}: {len(recorded)} and {len(given)} elements"
        if isinstance(recorded, np.ndarray):
            array = np.asarray(given)
            if array.shape == recorded.shape and np.allclose(array, recorded, equal_nan=True, **_TOLERANCES):
                return ""
        pairs = [(*both, f"{place}[{index}]") for index, both in enumerate(zip(recorded, given, strict=True))]
    else:
        return "" if _are_equal(recorded, given) else f"{place}: {recorded!r} and {given!r}"
    return next(filter(None, (first_difference(*pair) for pair in pairs)), "")


def _are_equal(recorded: Any, given: Any) -> bool:
    numbers = (int, float, np.number)
    if isinstance(recorded, bool) or not isinstance(recorded, numbers) or not isinstance(given, numbers):
        return type(recorded) is type(given) and bool(recorded == given)
    if math.isnan(recorded) or math.isnan(given):
        return math.isnan(recorded) and math.isnan(given)
    return math.isclose(recorded, given, rel_tol=_TOLERANCES["rtol"], abs_tol=_TOLERANCES["atol"])


class Recording:
    """The recorded inputs of a test, and the answers of the genuine node.

    Attributes:
        runs: a node with random numbers has several.
    """

    def __init__(self, file: Path, home: Path) -> None:
        """`home` is the folder of the test, which is `/HOME` in the recording."""
        assert file.exists(), f"this test has no recording {file.relative_to(FOLDER.parent)}: see its README"
        data = load(file)
        self.runs: list[Any] = data["runs"]
        self._inputs: list[Any] = data["inputs"]
        self._home = str(home)
        self._given = self._called = 0
        self._steps: Counter[str] = Counter()
        self._has_wall_clock = False

    def give(self, name: str, value: Any) -> Any:
        """Compare an input with the next distinct one, or with one that was given before.

        Return what to use in its place, to which the answers belong: the recorded value, as a message if
        `value` is one. A message with times of the wall clock is returned unchanged.

        Raises:
            AssertionError: the recording has another input here. The text has the place of the difference.
        """
        self._has_wall_clock = False
        given = self._plain(value)
        kind = getattr(value, "_md5sum", None)
        candidates = [*self._inputs[self._given :][:1], *self._inputs[: self._given][::-1]]
        misfits = (_misfit(each, name, kind, given) for each in candidates)
        found = next((index for index, misfit in enumerate(misfits) if not misfit), None)
        if found is None:
            has_more = self._given < len(self._inputs)
            why = _misfit(candidates[0], name, kind, given) if has_more else "it has no more inputs"
            raise AssertionError(f"the recording does not fit: input {self._given} ({name}): {why}")
        expected = candidates[found]
        if self._given < len(self._inputs) and found == 0:
            self._given += 1
        if kind is None:
            return expected["value"]
        return value if self._has_wall_clock else message_of(type(value), expected["value"])

    def take(self, name: str) -> Any:
        """Return the next input, which the test cannot or need not make again."""
        expected = self._inputs[self._given]
        assert expected["input"] == name, f"the recording does not fit: {name}, {expected['input']}"
        self._given += 1
        value = expected["value"]
        return message_of(load_message_class(expected["type"]), value) if "type" in expected else value

    def call(self, service: str, service_class: Any, request: Any) -> Any:
        """Return the response to the next request, or to the last one if it is repeated.

        Raises:
            PiprosError: the genuine node refused the request.
            AssertionError: the recording has another request here.
        """
        calls, given = self.runs[0]["calls"], self._plain(request)
        key = ("service", service, "md5", service_class._md5sum)
        if not self._called or _differ(calls[self._called - 1], key, given):
            assert self._called < len(calls), f"the recording has no call {self._called} ({service})"
            difference = _differ(calls[self._called], key, given)
            assert not difference, (
                f"the recording does not fit: call {self._called} ({service}): {difference}"
            )
            self._called += 1
        response = calls[self._called - 1]["response"]
        if response is None:
            raise PiprosError(f"the genuine node refused {service}")
        return message_of(service_class._response_class, response)

    def next_request(self, service: str, service_class: Any) -> Any:
        """Return the next request."""
        expected = self.runs[0]["calls"][self._called]
        assert expected["service"] == service, f"the recording does not fit: {service}, {expected['service']}"
        return message_of(service_class._request_class, expected["request"])

    def messages(self, topic: str, message_class: Any, run: int = 0) -> list[Any]:
        """Return the messages of a topic; none if the genuine node has published none."""
        found = self.runs[run]["messages"].get(topic)
        if found is None:
            return []
        assert found["md5"] == message_class._md5sum, f"{topic}: {found['type']} has changed"
        return [message_of(message_class, each) for each in found["messages"]]

    def value(self, name: str, run: int = 0) -> Any:
        """Return a plain value."""
        return self.runs[run]["values"][name]

    def step(self, name: str) -> Any:
        """Return the next one of a list of plain values."""
        self._steps[name] += 1
        return self.runs[0]["steps"][name][self._steps[name] - 1]

    def finish(self) -> None:
        """Check that the test has given all inputs, made all calls and compared all steps."""
        left = self._inputs[self._given :]
        assert not left, f"the recording has more inputs: {[each['input'] for each in left]}"
        calls = self.runs[0]["calls"][self._called :]
        assert not calls, f"the recording has more calls: {[each['service'] for each in calls]}"
        counts = {name: len(steps) for name, steps in self.runs[0]["steps"].items()}
        assert dict(self._steps) == counts, f"steps of the test and the recording: {self._steps}, {counts}"

    def _plain(self, value: Any) -> Any:
        """Return a message or value in the form of the recording."""
        if isinstance(value, Time | Duration):
            if value.secs < _WALL_CLOCK_S:
                return [value.secs, value.nsecs]
            self._has_wall_clock = True
            return [0, 0]
        if isinstance(value, Mapping):
            return {name: self._plain(each) for name, each in value.items()}
        if hasattr(value, "_slot_types"):
            names = [each for each in value.__slots__ if (value._type, each) != ("std_msgs/Header", "seq")]
            return {name: self._plain(getattr(value, name)) for name in names}
        if isinstance(value, bytes):
            return np.frombuffer(value, np.uint8)
        if isinstance(value, list | tuple) and not (value and isinstance(value[0], int | float)):
            return [self._plain(each) for each in value]
        return value.replace(self._home, "/HOME") if isinstance(value, str) else value


def _misfit(expected: Any, name: str, kind: str | None, given: Any) -> str:
    """Return in what an input differs from the expected one."""
    if (expected["input"], expected.get("md5")) != (name, kind):
        return f"it has {expected['input']} ({expected.get('type')}, {expected.get('md5')}) here"
    return first_difference(expected["value"], given, ".value")


def _differ(expected: Any, key: tuple[str, ...], given: Any) -> str:
    """Return in what a request differs from the expected one; `key` has names and values of fields."""
    fields = dict(zip(key[::2], key[1::2], strict=True))
    recorded = {name: expected[name] for name in fields}
    return first_difference({**recorded, "request": expected["request"]}, {**fields, "request": given})
