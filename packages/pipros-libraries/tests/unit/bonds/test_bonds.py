"""The life of one side of a bond, and the parts of bondpy that need no graph."""

import io
import random
from threading import Thread

import pytest

import rospy
from bondpy import bondpy
from pipros_libraries.bonds.life import NEXT, BondEvent, BondState, Life
from pipros_libraries.bonds.side import BondSide
from smclib import statemap
from tests.support.waiting import wait_until


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
        "NEW STATE       : second", "PUSH TO STATE   : first", "POP TO STATE    : second",
        "POPPING ON EMPTY STATE STACK.",
    ]  # fmt: skip


# One side of a bond in real time, without topics.


SOON_S, NEVER_S = 0.001, 3600.0


class Owner:
    """The messages and reports of a side."""

    def __init__(
        self, durations_s: dict[BondEvent, float], ignored_silences: int = 0, is_over: bool = False
    ) -> None:
        self.published: list[bool] = []
        self.changes: list[BondState] = []
        self.states: list[BondState] = []
        self.ignored_silences = ignored_silences
        self.is_over = is_over
        self.side = BondSide(
            dict.fromkeys(BondEvent, NEVER_S) | durations_s, send=self.published.append,
            notify=self.changes.append, enter=self.states.append, ignores_silence=self._ignores_silence,
            is_over=lambda: self.is_over,
        )  # fmt: skip

    def _ignores_silence(self) -> bool:
        wait_until(lambda: self.changes, what="the notification that the bond was formed")
        self.ignored_silences -= 1
        return self.ignored_silences >= 0


def test_a_bond_without_a_sister_breaks_at_the_connect_timeout() -> None:
    owner = Owner({BondEvent.CONNECT_TIMEOUT: SOON_S})
    owner.side.start_timeout()

    assert owner.side.wait(lambda state: state is BondState.DEAD, NEVER_S)
    wait_until(lambda: owner.changes == [BondState.DEAD])


def test_silence_breaks_a_bond_once_it_is_no_longer_ignored() -> None:
    owner = Owner({BondEvent.HEARTBEAT_TIMEOUT: SOON_S}, ignored_silences=2)

    assert owner.side.receive("sister", is_alive=True)

    wait_until(lambda: owner.changes == [BondState.ALIVE, BondState.DEAD])
    assert (owner.ignored_silences, owner.states) == (-1, [BondState.ALIVE, BondState.DEAD])


def test_an_end_that_no_sister_confirms_ends_at_the_disconnect_timeout() -> None:
    owner = Owner({BondEvent.DISCONNECT_TIMEOUT: SOON_S})
    owner.side.receive("sister", is_alive=True)
    owner.side.handle(BondEvent.BREAK)

    wait_until(lambda: owner.changes == [BondState.ALIVE, BondState.DEAD])
    assert (owner.published, owner.side.sister_ended_first) == ([False], False)


def test_a_third_instance_is_refused_and_a_sister_that_missed_the_end_learns_of_it() -> None:
    owner = Owner({})
    owner.side.receive("sister", is_alive=False)
    owner.side.receive("sister", is_alive=False)

    assert not owner.side.receive("stranger", is_alive=True)
    assert owner.side.receive("sister", is_alive=True)

    assert (owner.published, owner.side.sister_ended_first) == ([False, False], True)


def test_heartbeats_end_with_the_bond_and_once_more_thereafter() -> None:
    owner = Owner({BondEvent.CONNECT_TIMEOUT: SOON_S})
    owner.side.start_timeout()

    owner.side.publish_heartbeats(NEVER_S, NEVER_S)

    assert owner.published[-1] is False
    assert True not in owner.published[1:]


def test_heartbeats_and_waits_end_when_their_owner_does() -> None:
    owner = Owner({}, is_over=True)

    assert not owner.side.wait(lambda state: state is BondState.ALIVE, None)
    owner.side.publish_heartbeats(NEVER_S, NEVER_S)
    owner.side.wake()

    assert owner.published == [True]


def test_more_messages_of_a_living_sister_change_nothing() -> None:
    owner = Owner({})
    owner.side.receive("sister", is_alive=True)
    owner.side.receive("sister", is_alive=True)

    assert (owner.changes, owner.states, owner.published) == ([BondState.ALIVE], [BondState.ALIVE], [])
    owner.side.handle(BondEvent.HEARTBEAT_TIMEOUT)
    assert owner.side.state is BondState.DEAD


def test_a_wait_without_limit_ends_with_its_owner_even_before_the_start() -> None:
    owner = Owner({})
    waiting = Thread(target=owner.side.wait, args=(lambda state: state is BondState.ALIVE, None), daemon=True)
    waiting.start()

    owner.is_over = True  # nothing wakes the side: it was not started

    wait_until(lambda: not waiting.is_alive())
