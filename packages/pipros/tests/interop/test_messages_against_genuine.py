"""Messages of pipros compared with those of genuine genpy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.interop.programs.examine_messages import ask_genuine, ask_pipros
from tests.interop.random_definitions import HEADER, SEPARATOR, TYPES, full_text
from tests.support.examples import examples

SHARE = Path("/usr/share")
WITHOUT_PYTHON = ("nodelet", "shape_msgs", "stereo_msgs", "trajectory_msgs")
"""Packages of which the interop machine has the definitions, but no classes made by genpy."""
INCOMPLETE = ("tf",)
"""Packages whose messages use tf2_msgs, of which Debian installs a package without definitions."""


def installed_types() -> list[dict[str, Any]]:
    jobs: list[dict[str, Any]] = []
    for file in sorted(SHARE.glob("*/msg/*.msg")):
        jobs.append({"type": f"{file.parts[3]}/{file.stem}"})
    for file in sorted(SHARE.glob("*/srv/*.srv")):
        service = f"{file.parts[3]}/{file.stem}"
        jobs += [{"type": service + half, "service": service} for half in ("Request", "Response")]
    kept = [job for job in jobs if job["type"].partition("/")[0] not in (*WITHOUT_PYTHON, *INCOMPLETE)]
    return [{**job, "seed": seed, "count": 8} for seed, job in enumerate(kept)]


def test_every_installed_type_looks_the_same_to_a_program() -> None:
    jobs = installed_types()

    # Under another name, Debian's folder comes before the packages of pipros, as any other on the path.
    expected, found = ask_genuine(jobs), ask_pipros(jobs, ROS_PACKAGE_PATH=f"{SHARE}/.")

    assert len(jobs) > 150
    for job, genuine, ours in zip(jobs, expected, found, strict=True):
        assert ours == genuine, job["type"]


@pytest.mark.parametrize("first", range(0, examples(600), 100))
def test_made_up_types_look_the_same_to_a_program(first: int) -> None:
    seeds = range(first, first + 100)
    jobs = [{"type": "made/T", "text": full_text(seed), "seed": seed, "count": 4} for seed in seeds]

    answers = list(zip(jobs, ask_genuine(jobs), ask_pipros(jobs), strict=True))

    compared = [answer for answer in answers if not is_own_accident(answer[1])]
    assert len(compared) > 85
    for job, genuine, ours in compared:
        assert ours == genuine, f"seed {job['seed']}:\n{job['text']}"


def is_own_accident(answer: Any) -> bool:
    """Return True if genuine genpy failed in its own generated code, as it sometimes does."""
    return isinstance(answer, list) and answer[1] in ("SyntaxError", "AttributeError", "NameError")


ODD = ["'a'", "1.5", "300", "-1", "None", "[1, 2]", "['a']", "b'ab'", "True", "2", "10000000000000000000000"]
ODD += ["'\\xfc'", "[]", "(1, 2)", "[1.5]", "[None]", "[b'a']", "[300]", "[-1]", "(1, 2, 3)", "b'abcdefgh'"]


def test_values_that_do_not_fit_a_field_are_refused_with_genpys_text() -> None:
    jobs = []
    for kind in [*TYPES, "made/In", "std_msgs/Header"]:
        for array in ("", "[]", "[3]"):
            inner = f"{SEPARATOR}\nMSG: made/In\nint32 x\n{HEADER}"
            alone = [{"f": {"python": value}} for value in ODD]
            jobs.append({"type": "made/T", "text": f"{kind}{array} f\n{inner}", "odd": alone})
            within = f"int32 a\nmade/Q q\n{SEPARATOR}\nMSG: made/Q\n{kind}{array} f\nint8 b\n{inner}"
            jobs.append({"type": "made/T", "text": within, "odd": [{"q": value} for value in alone]})

    expected, found = ask_genuine(jobs), ask_pipros(jobs)

    compared = 0
    for job, genuine, ours in zip(jobs, expected, found, strict=True):
        for value, theirs, mine in zip(job["odd"], genuine["odd"], ours["odd"], strict=True):
            where = f"{job['text']}{value}"
            if isinstance(theirs, str) or (
                theirs[1] == "SerializationError" and theirs[2].startswith("field ")
            ):
                assert mine == theirs, where
                compared += 1
            else:  # genuine ROS raises AttributeError, or prints a text about its internals
                assert mine[:2] == ["raised", "SerializationError"], where
    assert compared > 1500
