"""Bonds between processes of both sides: formed, broken, and lost."""

import random
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.roscpp import compile_program
from tests.support.same_results import printed

PROGRAM = Path(__file__).parent / "programs" / "hold_bond.py"
EXAMINE = Path(__file__).parent / "programs" / "examine_statemap.py"
PAIRS = [("pipros", "genuine"), ("genuine", "pipros"), ("pipros", "pipros")]


def hold(ros: RosSystem, side: str, *arguments: str) -> Process:
    processes = getattr(ros, side).processes
    return processes.start(  # type: ignore[no-any-return]
        "python3", PROGRAM, *arguments, stdin=subprocess.PIPE
    )


def said(process: Process) -> list[str]:
    """Return the output without that of the callbacks, which run in other threads."""
    process.wait(60)
    return [line for line in process.stdout if not line.startswith("callback")]


@pytest.fixture
def ros(plain_ros: RosSystem) -> RosSystem:
    plain_ros.serve_master()
    return plain_ros


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_a_bond_is_formed_and_broken(ros: RosSystem, one: str, other: str) -> None:
    ended = {
        action: (hold(ros, one, action, "wait"), hold(ros, other, action, action))
        for action in ("break", "shutdown")
    }

    for action, (waiting, ending) in ended.items():
        waiting.wait_for("callback: formed")
        ending.write_line("end it")
        assert said(waiting) == [
            f"0.2 2.0 /bonds {action} 36", "AssertionError", "AssertionError", "formed: True True",
            "broken: True True SM.Dead", "stays broken: True",
        ], waiting.output  # fmt: skip
        assert "callback: broken" in waiting.stdout
        last = ["broken: True True SM.Dead", "stays broken: True"]
        if action == "shutdown":
            last = ["after shutdown: True"]
        assert said(ending)[4:] == last, ending.output


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_a_bond_breaks_when_the_other_process_is_gone(ros: RosSystem, one: str, other: str) -> None:
    waiting, killed = hold(ros, one, "gone", "wait", "8"), hold(ros, other, "gone", "wait", "8")
    killed.wait_for("formed: True True")
    waiting.wait_for("broken soon: False False")

    killed.kill()

    assert said(waiting)[-2:] == ["broken: True True SM.Dead", "stays broken: True"]
    assert "callback: broken" in waiting.stdout


def test_both_sides_give_up_alike_without_a_peer(ros: RosSystem) -> None:
    ours, genuine = (hold(ros, side, side, "alone") for side in ("pipros", "genuine"))

    assert said(ours)[1:] == said(genuine)[1:]
    assert "callback: broken" in ours.stdout
    assert "callback: formed" not in ours.stdout
    assert "broken: True True SM.Dead" in ours.stdout


@pytest.mark.parametrize("breaks", ["cpp", "python"])
def test_a_bond_with_bondcpp(ros: RosSystem, bondcpp: Path, breaks: str) -> None:
    role = "break" if breaks == "cpp" else "wait"
    cpp = ros.genuine.processes.start(bondcpp, "mixed", role, stdin=subprocess.PIPE)
    ours = hold(ros, "pipros", "mixed", "break" if breaks == "python" else "wait")
    cpp.wait_for("formed: 1")
    ours.wait_for("formed: True True")
    (cpp if breaks == "cpp" else ours).write_line("end it")

    assert said(ours)[-2:] == ["broken: True True SM.Dead", "stays broken: True"]
    assert cpp.wait(60) == 0
    assert cpp.stdout == ["formed: 1", "broken: 1"], cpp.output


@pytest.fixture(scope="module")
def bondcpp() -> Path:
    """A program of one side of a bond, built with genuine bondcpp."""
    return compile_program(PROGRAM.with_suffix(".cpp"), "bondcpp")


def test_smclib_answers_as_genuine() -> None:
    seed = str(random.randrange(10**6))  # noqa: S311
    answers = [printed(python, EXAMINE, seed) for python in (sys.executable, "/usr/bin/python3")]

    assert answers[0] == answers[1], seed
    assert len(answers[0].splitlines()) > 400
