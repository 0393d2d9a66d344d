"""Transforms of both sides: the same results for the same queries, and on one graph."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.interop.programs.examine_buffer import __file__ as buffer_script
from tests.interop.programs.examine_geometry import __file__ as geometry_script
from tests.support.ros import RosSystem
from tests.support.same_results import both_results, different_pairs

PROGRAMS = Path(__file__).parent / "programs"


def differing(script: str, seed: int, count: int) -> list[tuple[Any, Any]]:
    genuine, ours = both_results(script, seed, count)
    assert len(genuine) >= count
    return different_pairs(genuine, ours)


@pytest.mark.parametrize("seed", [1, 2])
def test_ten_thousand_questions_have_the_same_answers(seed: int) -> None:
    assert differing(buffer_script, seed, 50) == []


def test_invalid_frames_have_the_same_answers() -> None:
    assert differing(str(PROGRAMS / "examine_bad_frames.py"), 1, 400) == []


def test_messages_are_transformed_alike() -> None:
    assert differing(geometry_script, 1, 50) == []


@pytest.mark.timeout(200)
@pytest.mark.parametrize(
    ("sender", "asker"), [("pipros", "genuine"), ("genuine", "pipros"), ("pipros", "pipros")]
)
def test_nodes_of_both_sides_exchange_frames(plain_ros: RosSystem, sender: str, asker: str) -> None:
    plain_ros.serve_master()
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}
    sending = sides[sender].start("python3", PROGRAMS / "send_frames.py")

    ended = sides[asker].run("python3", PROGRAMS / "ask_frames.py", timeout_s=90)
    sending.press_ctrl_c()

    assert ended.stdout == [
        "1.0 2.0 3.0 1.0",
        "True 3.0",
        "0.0",
        '"nowhere" passed to lookupTransform argument source_frame does not exist. ',
        "[1.0, 2.0, 3.0]",
        "[('arm', 'base', '/sender'), ('base', 'map', '/sender'), ('hand', 'arm', '/sender')]",
    ], ended.output
