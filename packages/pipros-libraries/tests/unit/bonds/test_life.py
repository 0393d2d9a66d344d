"""The life of one side of a bond, and the parts of bondpy that need no graph."""

from __future__ import annotations

import io
import random

import pytest

import rospy
from bondpy import bondpy
from pipros_libraries.bonds.life import NEXT, BondEvent, BondState, Life
from smclib import statemap


def after(*events: BondEvent) -> Life:
    life = Life()
    for event in events:
        life.take(event)
    return life


def test_a_bond_is_formed_and_ends_in_agreement() -> None:
    assert after(BondEvent.SISTER_ALIVE).state is BondState.ALIVE
    assert after(BondEvent.SISTER_ALIVE, BondEvent.BREAK).state is BondState.ENDING
    assert after(BondEvent.SISTER_ALIVE, BondEvent.BREAK, BondEvent.SISTER_ENDS).state is BondState.DEAD
    assert after(BondEvent.SISTER_ALIVE, BondEvent.SISTER_ENDS).state is BondState.ENDING
    assert (
        after(BondEvent.SISTER_ALIVE, BondEvent.BREAK, BondEvent.DISCONNECT_TIMEOUT).state is BondState.DEAD
    )


def test_silence_ends_a_bond_at_once() -> None:
    assert after(BondEvent.CONNECT_TIMEOUT).state is BondState.DEAD
    assert after(BondEvent.SISTER_ALIVE, BondEvent.HEARTBEAT_TIMEOUT).state is BondState.DEAD


def test_a_sister_that_only_announces_its_end_has_formed_the_bond() -> None:
    life = after(BondEvent.SISTER_ENDS)
    assert (life.state, life.was_formed) == (BondState.ENDING, True)
    assert not after(BondEvent.BREAK).was_formed


@pytest.mark.parametrize("seed", range(20))
def test_a_dead_bond_stays_dead_after_any_event(seed: int) -> None:
    chance = random.Random(seed)  # noqa: S311
    order = [BondState.WAITING, BondState.ALIVE, BondState.ENDING, BondState.DEAD]
    life, reached = Life(), 0
    for _ in range(50):
        state = life.take(chance.choice(list(BondEvent)))
        assert order.index(state) >= reached
        reached = order.index(state)
    assert not any(state is BondState.DEAD for state, _ in NEXT)


def test_a_bond_before_its_start() -> None:
    called: list[str] = []
    bond = bondpy.Bond("bonds", "id", on_broken=lambda: called.append("broken"))
    bond.set_connect_timeout(rospy.Duration(3))
    bond.heartbeat_timeout = 2.5
    bond.disconnect_timeout = 1
    bond.set_heartbeat_period(rospy.Duration.from_sec(0.5))
    assert (bond.connect_timeout, bond.heartbeat_timeout, bond.disconnect_timeout) == (3.0, 2.5, 1.0)
    assert bond.heartbeat_period == 0.5
    with pytest.raises(ValueError, match="must be > 0 s"):
        bond.heartbeat_period = 0
    assert bond.wait_until_formed(0.01) is bond.wait_until_broken(rospy.Duration(0)) is False
    assert bond.sm.getState().getName() == "SM.WaitingForSister"

    bond.break_bond()
    bond.shutdown()

    assert (bond.is_broken(), called) == (True, ["broken"])
    assert str(bond).startswith("[Bond id, Instance ")
    assert bond.sm.getPreviousState() is not None


def test_a_callback_that_raises_does_not_affect_others() -> None:
    bond = bondpy.Bond("bonds", "id", on_broken=lambda: 1 / 0)
    bond.break_bond()
    assert bond.wait_until_broken(30)


def test_a_generated_machine_finds_what_it_needs() -> None:
    first, second = statemap.State("first", 1), statemap.State("second", 2)
    machine = statemap.FSMContext(first)
    stream = io.StringIO()
    machine.setDebugStream(stream)
    machine.setDebugFlag(True)

    machine.clearState()
    with pytest.raises(statemap.StateUndefinedException):
        machine.getState()
    machine.setState(second)
    machine.pushState(first)
    assert (machine.getState(), machine.getStateStackDepth(), machine.getPreviousState()) == (first, 1, first)
    machine.popState()
    assert machine.isStateStackEmpty()
    with pytest.raises(ValueError, match="empty state stack"):
        machine.popState()
    with pytest.raises(ValueError, match=r"statemap\.State"):
        machine.setState("first")  # type: ignore[arg-type]
    assert stream.getvalue().splitlines() == [
        "NEW STATE       : second",
        "PUSH TO STATE   : first",
        "POP TO STATE    : second",
        "POPPING ON EMPTY STATE STACK.",
    ]
