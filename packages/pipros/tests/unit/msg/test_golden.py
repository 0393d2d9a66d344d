"""Every included type, compared with the recorded one of genuine genpy (tests.golden.messages)."""

# needs the plugins: robot
from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

import genpy
import genpy.message
from pipros.msg import load_message_class, load_service_class
from tests.golden.messages.record import FILE, jobs, recorded
from tests.interop.programs.examine_messages import examine, random_values

GOLDEN = json.loads(FILE.read_text())
PACKAGES = sorted({name.partition("/")[0] for name in GOLDEN})


@cache
def jobs_of() -> dict[str, list[dict[str, Any]]]:
    """Return the types that ship, by package."""
    found: defaultdict[str, list[dict[str, Any]]] = defaultdict(list)
    for job in jobs():
        found[job["type"].partition("/")[0]].append(job)
    return found


def test_every_type_that_ships_was_recorded() -> None:
    assert {job["type"] for found in jobs_of().values() for job in found} == set(GOLDEN)


@pytest.mark.parametrize("package", PACKAGES)
def test_included_types_equal_those_of_genpy_byte_for_byte(package: str) -> None:
    for job in jobs_of()[package]:
        class_of = finder(job.get("service"))
        values = random_values(job, class_of)
        answer = json.loads(json.dumps(examine({**job, "values": values}, class_of, genpy)))
        assert recorded(answer) == GOLDEN[job["type"]], job["type"]


def finder(service_type: str | None) -> Callable[[str], Any]:
    if service_type is None:
        return load_message_class
    service = load_service_class(service_type)
    halves = {half._type: half for half in (service._request_class, service._response_class)}
    return lambda kind: halves.get(kind) or load_message_class(kind)
